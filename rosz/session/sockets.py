"""The connections of this process, which Zenoh opens and does not hand out."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

__all__ = ("connections",)

_OPEN_FILES = Path("/dev/fd")


def connections() -> Iterator[tuple[socket.socket, str, str]]:
    """Yield each connected socket, its own place and that of the other end, the newest first.

    Places are written as in endpoints: ``127.0.0.1:7447``, ``[::1]:7447``, ``/run/z.sock``. The
    socket is a copy, good until the next one is asked for.

    Raises:
        OSError: No file can be opened any more.
    """
    for number in sorted((int(file.name) for file in _OPEN_FILES.iterdir()), reverse=True):
        # Others listen, and any may be closed meanwhile.
        with suppress(OSError):
            # To close the copy of a file would give up all locks of this process on it (fcntl(2)).
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                continue
            with socket.socket(fileno=os.dup(number)) as found:
                yield found, _place(found.getsockname()), _place(found.getpeername())


def _place(address: Any) -> str:
    if not isinstance(address, tuple):
        return str(address)
    host = str(address[0]).partition("%")[0]
    return f"[{host}]:{address[1]}" if ":" in host else f"{host}:{address[1]}"
