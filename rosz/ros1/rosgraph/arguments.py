"""rosgraph's view of a command line."""

from __future__ import annotations

import sys
from collections.abc import Sequence

__all__ = ("myargv",)


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return a command line without its remappings, for the program's own option parser.

    Args:
        argv: With the program's name; that of the process when not given.
    """
    return [word for word in (sys.argv if argv is None else argv) if ":=" not in word]
