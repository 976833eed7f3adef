"""roslaunch: launches that scripts start, read and end (ROS wiki, roslaunch API).

Launch files are read by `rosz.launch.plan`, and run by `rosz.launch.run` on a thread of the script.
Modules that talk to other launches by XML-RPC (``server``, ``remote``, ``child``) are missing.

Programs also import its modules, as in ROS 1.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from types import ModuleType

from rosz.ros1.tools.roslaunch import config, core, loader, parent, pmon
from rosz.ros1.tools.roslaunch import node_args as node_args
from rosz.ros1.tools.roslaunch.config import ROSLaunchConfig
from rosz.ros1.tools.roslaunch.core import (
    Executable,
    Machine,
    Master,
    Node,
    Param,
    RLException,
    RosbinExecutable,
    Test,
)
from rosz.ros1.tools.roslaunch.loader import LoadException, XmlLoader, XmlParseException
from rosz.ros1.tools.roslaunch.parent import ROSLaunch, ROSLaunchParent

xmlloader: ModuleType  # built by the importer, as the next ones
arg_dump: ModuleType
launch: ModuleType
nodeprocess: ModuleType
param_dump: ModuleType
rlutil: ModuleType
scriptapi: ModuleType
substitution_args: ModuleType

NAME = "roslaunch"

__all__ = (
    "NAME",
    "Executable",
    "LoadException",
    "Machine",
    "Master",
    "Node",
    "Param",
    "RLException",
    "ROSLaunch",
    "ROSLaunchConfig",
    "ROSLaunchParent",
    "RosbinExecutable",
    "Test",
    "XmlLoader",
    "XmlParseException",
    "arg_dump",
    "config",
    "configure_logging",
    "core",
    "launch",
    "loader",
    "main",
    "node_args",
    "nodeprocess",
    "param_dump",
    "parent",
    "pmon",
    "rlutil",
    "scriptapi",
    "substitution_args",
    "xmlloader",
)


def configure_logging(uuid: str) -> None:
    """Do nothing: the launch writes a log of its own, and nodes write theirs.

    Args:
        uuid: Id of the run.
    """
    del uuid


def main(argv: Sequence[str] | None = None) -> None:
    """Run ``roslaunch`` with a command line, and end this process if it fails.

    Args:
        argv: Command line with the program name; that of the process when not given.
    """
    words = (sys.argv if argv is None else argv)[1:]
    command = [sys.executable, "-P", "-m", "rosz", "launch", *words]
    code = subprocess.run(command, check=False).returncode
    if code:
        sys.exit(code)
