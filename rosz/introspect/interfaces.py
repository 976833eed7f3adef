"""Network interfaces that come while a core runs: a VPN, a stick that is plugged in again.

With keys each interface is listened on by itself. What Zenoh listens on is settled when a session
opens, so a further router, linked to the first one within the machine, listens on those that come.
"""

from __future__ import annotations

import logging
import socket
import threading

import msgspec

from rosz.errors import RoszError
from rosz.session import Session, SessionConfig, places_of

__all__ = ("Latecomers",)

_AGAIN_SECONDS = 2.0
_INTERFACE = "#iface="
_log = logging.getLogger("rosz.core")


class Latecomers:
    """Listens on interfaces that come from now on, until closed.

    Args:
        config: The session of the core, which listens on those that are there.
    """

    def __init__(self, config: SessionConfig) -> None:
        self._config = config
        self._known = set(socket.if_nameindex())
        self._sessions: dict[tuple[int, str], Session] = {}
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        if any(_INTERFACE in place for place in places_of(config)[0]):
            self._thread = threading.Thread(target=self._watch, name="rosz-interfaces", daemon=True)
            self._thread.start()

    def _watch(self) -> None:
        while not self._over.wait(_AGAIN_SECONDS):
            # One that went and came again has another number.
            there = set(socket.if_nameindex())
            for interface in self._known - there:
                if interface in self._sessions:
                    self._sessions.pop(interface).close()
            for interface in sorted(there - self._known):
                self._listen(interface)
            self._known = there

    def _listen(self, interface: tuple[int, str]) -> None:
        name = interface[1]
        listen, _ = places_of(self._config)
        places = [place for place in listen if place.rpartition(_INTERFACE)[2] == name]
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
            self._sessions[interface] = Session.open(further)
        except RoszError as error:
            _log.warning("cannot listen on '%s', which has come up: %s", name, error)
            return
        for place in places:
            _log.warning("listening on %s, which has come up", place)

    def close(self) -> None:
        """Listen there no more; again is no error."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()
        while self._sessions:
            self._sessions.popitem()[1].close()
