"""The conditions of a run: compiled sources, and real-time priority on a machine that is busy."""

from __future__ import annotations

import compileall
import os
import sys
from pathlib import Path

import rosz

__all__ = ("REAL_TIME", "prepare")

REAL_TIME = "--real-time"
_PRIORITY = 5


def prepare() -> None:
    """Compile what is imported, as pip does when it installs, since ROS 1's programs are compiled.

    With ``--real-time`` in the command line, this process and all that it starts run before all
    others of the machine, so that its load does not count. That needs root.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    for folder in (Path(rosz.__file__).parent, *map(Path, sys.path[-1:])):
        compileall.compile_dir(folder, quiet=2)
    if REAL_TIME in sys.argv:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
