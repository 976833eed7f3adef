"""rosbag.rosbag_main: the command as a function."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from typing import NoReturn

__all__ = ("rosbagmain",)


def rosbagmain(argv: Sequence[str] | None = None) -> NoReturn:
    """Run ``rosz bag``, and exit.

    Args:
        argv: The words of the command line, ``rosbag`` first; those of the process if omitted.

    Raises:
        SystemExit: Always; with the exit code.
    """
    words = (sys.argv if argv is None else argv)[1:]
    sys.exit(subprocess.call([sys.executable, "-P", "-m", "rosz", "bag", *words]))
