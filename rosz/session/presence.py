"""Knowing of the other processes of this machine before there is a link to any of them.

Whoever finds nobody at the meeting point may be the first, or come right after the death of the
process that held it, whose peers have not found the newcomer yet. So each leaves a mark that its
death takes away: a socket in Linux's abstract namespace, which nothing is ever sent to.
"""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from zlib import crc32

__all__ = ("Presence", "is_anybody_there")

_SOCKETS = Path("/proc/net/unix")


class Presence:
    """The mark of a session, until closed.

    Args:
        rendezvous: Endpoint where it meets others.
        zid: It.
    """

    def __init__(self, rendezvous: str, zid: str) -> None:
        self._socket: socket.socket | None = None
        if sys.platform == "linux":
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self._socket.bind(f"\0{_mark(rendezvous)}{zid}")

    def close(self) -> None:
        """Take the mark away; again is no error."""
        if self._socket is not None:
            self._socket.close()


def is_anybody_there(rendezvous: str) -> bool:
    """Tell whether any session that meets others at an endpoint runs on this machine."""
    try:
        return f" @{_mark(rendezvous)}" in _SOCKETS.read_text(errors="replace")
    except OSError:  # another system than Linux has no marks
        return False


def _mark(rendezvous: str) -> str:
    return f"rosz/{crc32(rendezvous.encode()):08x}/"
