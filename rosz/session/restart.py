"""Starting this program afresh in its own process, with the state that it must not lose.

The program is executed anew with the same arguments, process id, terminal and working directory.
Everything else ends as if the process were killed: its threads, and its links. The state
waits in a file without a name, whose descriptor the new program finds in its environment.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO, Final, NoReturn

_VARIABLE: Final = "_ROSZ_HANDOVER"
_STANDARD_OUTPUT: Final = 1
_STANDARD_ERROR: Final = 2
_OPEN_FILES: Final = Path("/dev/fd")


def restart_program(handover: bytes) -> NoReturn:
    """Execute this program anew.

    Args:
        handover: The state, which `take_handover` returns there.

    Raises:
        OSError: The program cannot be executed any more; nothing has changed then.
    """
    with _open_file() as file:
        file.write(handover)
        file.flush()
        _inherit_only(file.fileno())
        sys.stdout.flush()
        sys.stderr.flush()
        # The new program would be ended by a timer of this one, and write where nobody reads.
        timer = signal.setitimer(signal.ITIMER_REAL, 0)
        if sys.stdout.fileno() != _STANDARD_OUTPUT:
            os.dup2(sys.stdout.fileno(), _STANDARD_OUTPUT)
        try:
            variables = os.environ | {_VARIABLE: str(file.fileno())}
            os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], variables)  # noqa: S606  # no shell
        except OSError:
            signal.setitimer(signal.ITIMER_REAL, *timer)
            raise


def _inherit_only(number: int) -> None:
    """Let the new program inherit one file, beside the standard ones.

    Zenoh opens the lock of a unix socket so that it would be inherited, and held for ever.
    """
    for descriptor in [int(file.name) for file in _OPEN_FILES.iterdir()]:
        if descriptor > _STANDARD_ERROR:
            with suppress(OSError):  # the folder itself, or closed meanwhile by another thread
                os.set_inheritable(descriptor, descriptor == number)


def take_handover() -> bytes | None:
    """Return the state that was handed over; ``None`` if this program was started regularly."""
    number = os.environ.pop(_VARIABLE, "")
    if not number:
        return None
    with os.fdopen(int(number), "rb") as file:
        file.seek(0)
        return file.read()


def _open_file() -> IO[bytes]:
    """Return a new file without a name; it is in memory where the system allows that."""
    if sys.platform == "linux":
        return os.fdopen(os.memfd_create("rosz-handover"), "w+b")
    return tempfile.TemporaryFile()
