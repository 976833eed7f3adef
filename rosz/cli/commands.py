"""The table of all commands: the module that declares each, and its purpose."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosz.cli.declare import App

COMMANDS = {
    "launch": "start the nodes of a launch file",
    "run": "run an executable of a package",
    "core": "run a meeting point with a copy of the parameters",
    "bridge": "let programs that speak other protocols take part",
    "param": "get and set parameters",
    "reconfigure": "read and change settings of nodes while they run",
    "topic": "list, show, measure and publish topics",
    "bag": "record and play bags, show, change and repair them",
    "service": "list and call services",
    "action": "list actions, and send goals to them",
    "tf": "list, print, watch and publish transforms",
    "node": "list, inspect, ping and kill nodes",
    "msg": "show message types",
    "srv": "show service types",
    "gen": "write Python modules for the messages of a package",
    "pkg": "list, find, create and check packages",
    "log": "follow the log of all nodes, set levels",
    "keys": "make and check the keys that links between machines need",
    "graph": "print or draw who sends what to whom",
    "web": "show the running system in a browser",
    "doctor": "find problems, and print what shows them and what to do",
    "turtlesim": "save pictures of turtlesims",
    "env": "print shell code that makes ROS 1's command names run rosz",
    "help": "list and print the pages of the manual",
}
"""Every command with its summary, in the order of ``rosz --help``."""

OLD_NAMES = {
    "rosbag": "bag",
    "roscore": "core",
    "roslaunch": "launch",
    "rosmsg": "msg",
    "rosnode": "node",
    "rosparam": "param",
    "rosrun": "run",
    "rosservice": "service",
    "rossrv": "srv",
    "rostopic": "topic",
    "roswtf": "doctor",
}
"""ROS 1's names of commands; a command that is run by one has it in its help and its errors."""

_APPS = {
    "msg": "types:msg",
    "srv": "types:srv",
    "gen": "types:gen",
    "graph": "pictures:graph",
    "web": "system:web",
    "doctor": "system:doctor",
    "turtlesim": "pictures:turtlesim",
    "help": "system:manual",
}
"""Module and name of each app that is not ``app`` in the module named like its command."""


def load(name: str) -> App:
    """Import a command."""
    module, _, attribute = _APPS.get(name, f"{name}:app").partition(":")
    app: App = getattr(import_module(f"rosz.cli.{module}"), attribute)
    return app


def format_rows(rows: Iterable[tuple[str, str]]) -> str:
    """Return names with their descriptions as lines of two columns."""
    listed = list(rows)
    width = max((len(name) for name, _ in listed), default=0)
    return "".join(f"  {name:<{width}}  {text}\n" for name, text in listed)
