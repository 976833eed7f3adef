"""xacro: the program of ROS 1's package, which is PyPI's distribution of the same source.

It asks ament_index_python for ``$(find PACKAGE)``; `rosz.ros2` has that, with the packages of rosz.

Expressions may take forever, and all memory: ``${9**9**9}``. Python cannot stop one from within, so
the file is expanded in a process of its own, which the system stops.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
from contextlib import suppress
from pathlib import Path

from rosz.ros1.importer import install

_SECONDS = 20
_BYTES = 2 << 30


def main() -> None:
    """Expand the xacro file of the command line."""
    # A script 'xacro.py' would be imported in place of the module.
    own = Path(sys.argv[0]).resolve().parent
    sys.path[:] = [folder for folder in sys.path if Path(folder or ".").resolve() != own]
    install()
    try:
        import xacro
    except ModuleNotFoundError as error:
        if error.name != "xacro":
            raise
        sys.exit("xacro: it is not installed here; run: pip install 'rosz[xacro]'")
    child = os.fork()
    if not child:
        _limit(resource.RLIMIT_CPU, _SECONDS)
        _limit(resource.RLIMIT_AS, _BYTES)
        xacro.main()
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends the child, too
    signal.signal(signal.SIGTERM, lambda *_: os.kill(child, signal.SIGTERM))
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code == -signal.SIGXCPU:
        sys.exit(
            f"xacro: stopped after {_SECONDS} s of processor time: an expression or a macro"
            " computes too long"
        )
    sys.exit(code if code >= 0 else 128 - code)


def _limit(kind: int, most: int) -> None:
    """Limit this process further, if the system has such a limit."""
    with suppress(OSError, ValueError):  # there is a lower one, or macOS
        resource.setrlimit(kind, (most, resource.getrlimit(kind)[1]))
