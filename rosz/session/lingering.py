"""Letting go of a link that was cut, without waiting for the other end.

Zenoh has the system wait, when it closes a TCP connection, until the other end has taken in what it
was sent: for ten seconds where a cable was cut, or the process there is stopped, on the thread that
receives for the whole session.
A new link would be up long before anything came through it. Without that wait (SO_LINGER,
socket(7)) nothing is lost: the system goes on sending by itself.
"""

from __future__ import annotations

import re
import socket
import struct
from contextlib import suppress
from typing import Any

import zenoh

from rosz.lifecycle import Closable
from rosz.session.declared import CallbackThread, open_channel
from rosz.session.sockets import connections

__all__ = ("never_linger",)

_TCP = re.compile(r"(?:tcp|tls)/([^%#?\]]+)(?:%\w+)?(\]?:\d+)")
_NO_WAIT = struct.pack("ii", 0, 0)


def never_linger(raw: Any) -> Closable:
    """Have a session close its TCP links at once, those that are open and those to come.

    Args:
        raw: The open Zenoh session.

    Returns:
        What does so, for as long as it is kept.
    """
    listener = raw.info.declare_link_events_listener(open_channel(), history=True)
    return CallbackThread("watch of links", listener, _meet)


def _meet(event: Any) -> None:
    ends = [_TCP.match(locator) for locator in (event.link.src, event.link.dst)]
    if event.kind != zenoh.SampleKind.PUT or None in ends:
        return
    places = tuple("".join(end.groups()) for end in ends if end is not None)
    with suppress(OSError):  # no file can be opened any more: the link will linger
        for connection, *its_places in connections():
            if tuple(its_places) == places:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_WAIT)
                return
