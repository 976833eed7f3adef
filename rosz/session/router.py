"""A Zenoh router at the rendezvous: the session of ``rosz core``.

Nodes find each other without it. It provides what needs a permanent process: a rendezvous that does
not move, and links to other machines.
"""

from __future__ import annotations

import logging
import re
import socket
import threading
from collections.abc import Sequence
from typing import Final, Self

import msgspec

from rosz.environment import Environment
from rosz.errors import RoszError, TransportError
from rosz.lifecycle import Lifecycle
from rosz.session.config import SessionConfig
from rosz.session.opening import outlasted_silence, places_of
from rosz.session.session import Session
from rosz.wire import Endpoint

__all__ = ("Router",)

_OCCUPIED: Final = re.compile(
    r"bound to (\S+?): \[.*address already in use|listener on (\S+) - unable to acquire lock",
    re.IGNORECASE,
)
"""Errors of Zenoh for a TCP endpoint, and for a unix socket, that another process holds."""
_POLL_SECONDS: Final = 2.0
_ON_INTERFACE: Final = "#iface="
_log = logging.getLogger("rosz.core")


class Router:
    """A router, until closed.

    Args:
        environment: The settings of the process.
        listen: Further endpoints to listen at.
        connect: Further endpoints to connect to.

    Attributes:
        endpoints: The endpoints that it listens at.
        connect: The endpoints that it connects to.
        has_rules: Whether rules say what other machines may do.
        outlasted_silence: Seconds of silence after which others give up its links.
        session: Its session.

    Raises:
        TransportError: An endpoint is occupied or malformed.
    """

    def __init__(
        self, environment: Environment, listen: Sequence[str] = (), connect: Sequence[str] = ()
    ) -> None:
        listen = (*environment.listen, *listen)
        if environment.multicast and all(Endpoint(text).is_local for text in listen):
            # Sessions that find this router by multicast have to reach it.
            meeting = Endpoint(environment.rendezvous)
            if meeting.protocol == "tcp" and meeting.port is not None:
                listen += (f"tcp/0.0.0.0:{meeting.port}",)
        both = (*environment.connect, *connect)
        config = SessionConfig.of(environment, mode="router", listen=listen, connect=both)
        self.endpoints: tuple[str, ...]
        self.connect: tuple[str, ...]
        self.endpoints, self.connect = places_of(config)
        self.has_rules: bool = config.keys is not None and config.keys.rules is not None
        self.outlasted_silence: float = outlasted_silence(config)
        self._lifecycle = Lifecycle("the router", log=_log)
        try:
            self.session: Session = self._lifecycle.keep(Session.open(config))
        except TransportError as error:
            match = _OCCUPIED.search(str(error))
            if match is None:
                raise
            place = match[1] or match[2]
            endpoint = next((one for one in self.endpoints if one.endswith(place)), place)
            raise TransportError(
                f"'{endpoint}' is occupied: another core, or a node that the others meet at, holds"
                " it; nodes keep working with it, or end it and start the core again"
            ) from error
        if any(_ON_INTERFACE in place for place in self.endpoints):
            self._lifecycle.keep(_NewInterfaces(config))

    def close(self) -> None:
        """Close the router; a second call has no effect."""
        self._lifecycle.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _NewInterfaces:
    """Listens on network interfaces, such as a VPN's, that appear while a router runs.

    Seen with eclipse-zenoh 1.10.2: the endpoints that a session listens at are fixed when it opens,
    and with keys each interface has an endpoint of its own. So a further router, linked to the
    first one within the machine, listens on later interfaces. Not reported upstream yet.
    """

    def __init__(self, config: SessionConfig) -> None:
        self._config = config
        self._known = set(socket.if_nameindex())
        self._sessions: dict[tuple[int, str], Session] = {}
        self._closing = threading.Event()
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
            self._sessions[interface] = Session.open(further)
        except RoszError as error:
            _log.warning("cannot listen on '%s', which has come up: %s", name, error)
            return
        for place in places:
            _log.warning("listening on %s, which has come up", place)

    def close(self) -> None:
        """Stop listening there; a second call has no effect."""
        self._closing.set()
        self._thread.join()
        while self._sessions:
            self._sessions.popitem()[1].close()
