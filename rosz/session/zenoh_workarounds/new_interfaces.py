"""Network interfaces that appear while a router runs, such as that of a VPN.

Seen with eclipse-zenoh 1.10.2: the endpoints that a session listens at are fixed when it opens, and
with keys each interface has an endpoint of its own. Without this module, a router would not listen
on later interfaces. So a further router, linked to the first one within the machine, listens there.
Not reported upstream yet.
"""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Callable
from typing import Final

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.session.config import SessionConfig
from rosz.session.opening import places_of

__all__ = ("NewInterfaces",)

_POLL_SECONDS: Final = 2.0
_ON_INTERFACE: Final = "#iface="
_log = logging.getLogger("rosz.core")


class NewInterfaces:
    """Listens on network interfaces that appear while a router runs, until closed.

    Args:
        config: The session of the router, which listens on the interfaces that exist.
        open_session: Function that opens a session.
    """

    def __init__(
        self, config: SessionConfig, open_session: Callable[[SessionConfig], Closable]
    ) -> None:
        self._config = config
        self._open_session = open_session
        self._known = set(socket.if_nameindex())
        self._sessions: dict[tuple[int, str], Closable] = {}
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        if any(_ON_INTERFACE in place for place in places_of(config)[0]):
            self._thread = threading.Thread(target=self._watch, name="rosz-interfaces", daemon=True)
            self._thread.start()

    def _watch(self) -> None:
        while not self._closing.wait(_POLL_SECONDS):
            # An interface that disappeared and came back has another number.
            found = set(socket.if_nameindex())
            for interface in self._known - found:
                if interface in self._sessions:
                    self._sessions.pop(interface).close()
            for interface in sorted(found - self._known):
                self._listen(interface)
            self._known = found

    def _listen(self, interface: tuple[int, str]) -> None:
        name = interface[1]
        listen, _ = places_of(self._config)
        places = [place for place in listen if place.rpartition(_ON_INTERFACE)[2] == name]
        if not places:
            return
        further = msgspec.structs.replace(
            self._config,
            rendezvous=places[0],
            hold_rendezvous=False,
            listen=tuple(places[1:]),
            connect=(self._config.rendezvous,),
            multicast=False,
        )
        try:
            self._sessions[interface] = self._open_session(further)
        except RoszError as error:
            _log.warning("cannot listen on '%s', which has come up: %s", name, error)
            return
        for place in places:
            _log.warning("listening on %s, which has come up", place)

    def close(self) -> None:
        """Stop listening there; a second call has no effect."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        while self._sessions:
            self._sessions.popitem()[1].close()
