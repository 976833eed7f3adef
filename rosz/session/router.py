"""A Zenoh router at the rendezvous: the session of ``rosz core``.

Nodes find each other without it. It provides two things that need a permanent process: a rendezvous
that does not move, and links to other machines.
"""

from __future__ import annotations

import errno
import logging
import os
import re
import resource
import socket
import threading
from collections.abc import Sequence
from typing import Final

import msgspec

from rosz.environment import Environment
from rosz.errors import RoszError, TransportError
from rosz.lifecycle import Closing, Lifecycle
from rosz.session.config import SessionConfig, ephemeral, keys_of
from rosz.session.dialling import Dialling, who_answers
from rosz.session.local_peers import CoreLock, LocalPeers, describe_process, find_holder
from rosz.session.old_peers import OldPeers
from rosz.session.opening import outlasted_silence, places_of, settings_text
from rosz.session.probe import is_listening
from rosz.session.session import Session
from rosz.wire import Endpoint

_OCCUPIED: Final = re.compile(
    r"bound to (\S+?): \[.*address already in use|listener on (\S+) - unable to acquire lock",
    re.IGNORECASE,
)
"""Errors of Zenoh for a TCP endpoint, and for a unix socket, that another process holds."""
_POLL_SECONDS: Final = 2.0
_ON_INTERFACE: Final = "#iface="
_SUCCESSION_SECONDS: Final = 0.5
_IDENTIFY_TIMEOUT: Final = 3.0
_FEW_FILES: Final = 1024
"""Limit of open files below which a router says how few nodes it has room for."""

_log = logging.getLogger("rosz.core")


class _OpenRouter(Closing):
    """The lifecycle and the dialled endpoints of a router."""

    _dialling: Dialling

    def __init__(self, what: str) -> None:
        self._lifecycle = Lifecycle(what, log=_log)

    def announce(self) -> dict[str, bool]:
        """Return the endpoints that it dials, each with whether it is reached, to be printed."""
        return self._dialling.announce()

    def close(self) -> None:
        """Close the router; a second call has no effect."""
        self._lifecycle.close()


class Router(_OpenRouter):
    """A router, until closed.

    While another process holds the rendezvous, the router is linked to that process, and it takes
    the place when it is free.

    Args:
        environment: The settings of the process.
        listen: Further endpoints to listen at.
        connect: Further endpoints to connect to.

    Attributes:
        endpoints: The endpoints that it listens at.
        has_rules: Whether rules say what other machines may do.
        outlasted_silence: Seconds of silence after which others give up its links.
        holder: The process that held the rendezvous at the start; empty if none did.
        session: Its session.

    Raises:
        TransportError: An endpoint is occupied or malformed, another core of this domain runs on
            this machine, or the holder of the rendezvous is not Zenoh.
    """

    def __init__(
        self, environment: Environment, listen: Sequence[str] = (), connect: Sequence[str] = ()
    ) -> None:
        config = _config(environment, listen, connect)
        self.endpoints: tuple[str, ...]
        self.has_rules: bool = config.keys is not None and config.keys.rules is not None
        self.outlasted_silence: float = outlasted_silence(config)
        self.holder: str = ""
        self._is_full = False
        _allow_open_files()
        super().__init__("the router")
        self.session: Session
        try:
            if _is_shareable(config):
                self._lifecycle.keep(CoreLock(environment.rendezvous, environment.domain))
            if _is_shareable(config) and is_listening(config.rendezvous):
                config = self._share(config)
            try:
                self.session = Session.open(config)
            except TransportError as error:
                # Another process may have been faster.
                if not (_OCCUPIED.search(str(error)) and _is_shareable(config)):
                    raise
                config = self._share(config)
                self.session = Session.open(config)
        except TransportError as error:
            self._lifecycle.close()
            raise _name_occupied(error, config) from error
        self._lifecycle.keep(self.session)
        listen, _ = places_of(config)
        self.endpoints = tuple(place for place in listen if place != ephemeral())
        _check_certificate(config)
        self._dialling = self._lifecycle.keep(Dialling(self.session, config))
        self._lifecycle.keep(OldPeers(self.session, config))
        if any(_ON_INTERFACE in place for place in listen):
            self._lifecycle.keep(_NewInterfaces(config))
        if self.holder:
            self._lifecycle.keep(_Successor(self.session, config))

    def _share(self, config: SessionConfig) -> SessionConfig:
        """Return the configuration of a router whose rendezvous another process holds."""
        self.holder = _check_holder(config)
        return msgspec.structs.replace(config, rendezvous_is_held=True)

    def check_room(self) -> None:
        """Log a warning when there is no more room for links, and when there is again."""
        try:
            os.close(os.open(os.devnull, os.O_RDONLY))
        except OSError as error:
            if error.errno not in {errno.EMFILE, errno.ENFILE} or self._is_full:
                return
            self._is_full = True
            limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
            _log.warning(
                "no room for more links: %s (the limit is %d, 'ulimit -Hn'); newcomers wait",
                error.strerror,
                limit,
            )
        else:
            if self._is_full:
                _log.warning("there is room for links again")
            self._is_full = False


def _allow_open_files() -> None:
    """Allow this process as many open files as it may have, since each link is one."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    except ValueError:  # on macOS, unlimited is more than the system allows
        return
    if 0 < most < _FEW_FILES:
        _log.warning(
            "this core may open %d files, and has a link to each node: raise the limit for more"
            " nodes (ulimit -Hn)",
            most,
        )


class ExternalRouter(_OpenRouter):
    """A router that is linked to other machines alone, until closed.

    Args:
        environment: The settings of the process.
        listen: Endpoints to listen at.
        connect: Endpoints to connect to.

    Attributes:
        endpoints: The endpoints that it listens at.
        outlasted_silence: Seconds of silence after which others give up its links.
        session: Its session.

    Raises:
        TransportError: An endpoint is occupied or malformed.
    """

    def __init__(
        self, environment: Environment, listen: Sequence[str], connect: Sequence[str]
    ) -> None:
        config = SessionConfig(
            mode="router",
            rendezvous=environment.rendezvous,
            hold_rendezvous=False,
            beyond=True,
            listen=tuple(listen),
            connect=tuple(connect),
            multicast=environment.multicast,
            keys=keys_of(environment),
        )
        self.endpoints: tuple[str, ...]
        self.endpoints, _ = places_of(config)
        self.outlasted_silence: float = outlasted_silence(config)
        super().__init__("the router beyond the machine")
        try:
            self.session: Session = self._lifecycle.keep(Session.open(config))
        except TransportError as error:
            raise _name_occupied(error, config) from error
        self._dialling = self._lifecycle.keep(Dialling(self.session, config))


def zenoh_configuration(
    environment: Environment, listen: Sequence[str] = (), connect: Sequence[str] = ()
) -> str:
    """Return the Zenoh configuration of a router, as JSON, such as zenohd reads.

    Args:
        environment: The settings of the process.
        listen: Further endpoints to listen at.
        connect: Further endpoints to connect to.

    Raises:
        TransportError: A configuration value is refused.
        UsageError: The override text is malformed, or a protocol cannot use keys.
    """
    return settings_text(_config(environment, listen, connect))


def _config(
    environment: Environment, listen: Sequence[str], connect: Sequence[str]
) -> SessionConfig:
    listen = (*environment.listen, *listen)
    if environment.multicast and all(Endpoint(text).is_local for text in listen):
        # Sessions that find this router by multicast have to reach it.
        meeting = Endpoint(environment.rendezvous)
        if meeting.protocol == "tcp" and meeting.port is not None:
            listen += (f"tcp/0.0.0.0:{meeting.port}",)
    both = (*environment.connect, *connect)
    return SessionConfig.of(environment, mode="router", listen=listen, connect=both)


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
            interfaces = set(socket.if_nameindex())
            for interface in self._known - interfaces:
                if interface in self._sessions:
                    self._sessions.pop(interface).close()
            for interface in sorted(interfaces - self._known):
                self._listen(interface)
            self._known = interfaces

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


class _Successor:
    """Listens at the rendezvous once the process that holds it has ended.

    Seen with eclipse-zenoh 1.10.2: a session that listens as soon as an endpoint is free (with
    ``listen/timeout_ms`` -1) takes ten seconds to close while the endpoint is occupied. So a
    further router, linked to the first one, takes the place. Not reported upstream yet.
    """

    def __init__(self, session: Session, config: SessionConfig) -> None:
        self._session = session
        self._config = config
        self._taken: Session | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="rosz-successor", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        while self._taken is None and not self._closing.wait(_SUCCESSION_SECONDS):
            try:
                if not self._is_held():
                    self._take()
            except RoszError as error:
                # Another process was faster.
                _log.debug("cannot listen at the rendezvous: %s", error)

    def _is_held(self) -> bool:
        place = Endpoint(self._config.rendezvous)
        ends = [Endpoint(end) for each in self._session.links().values() for end in each]
        ports = {place.port} - {None}
        if any(end.address == place.address or end.port in ports for end in ends):
            return True
        return is_listening(self._config.rendezvous)

    def _take(self) -> None:
        further = SessionConfig(
            mode="router",
            rendezvous=self._config.rendezvous,
            connect=(self._session.local_endpoint,),
            keys=self._config.keys,
        )
        self._taken = Session.open(further)
        _log.warning("listening on %s, which has become free", self._config.rendezvous)

    def close(self) -> None:
        """Stop listening there; a second call has no effect."""
        self._closing.set()
        self._thread.join()
        taken, self._taken = self._taken, None
        if taken is not None:
            taken.close()


def _is_shareable(config: SessionConfig) -> bool:
    """Tell whether a router may leave its rendezvous to another process for now."""
    place = Endpoint(config.rendezvous)
    return (place.is_unix or place.is_tcp) and not (
        config.rendezvous_is_held or config.config_file or "listen" in config.override
    )


def _check_holder(config: SessionConfig) -> str:
    """Return who listens at the rendezvous; refuse what is not Zenoh."""
    peers = LocalPeers.read(config.rendezvous)
    pid = find_holder(config.rendezvous)
    who = "another process" if pid is None else describe_process(pid)
    is_ours = any(peer.pid == pid for peer in peers)
    answers = is_ours or who_answers(config.rendezvous, config, _IDENTIFY_TIMEOUT)
    if not answers and is_listening(config.rendezvous):
        raise TransportError(
            f"'{config.rendezvous}' is held by {who}, which does not speak Zenoh: end it, or set"
            " ROSZ_RENDEZVOUS to another endpoint for all processes"
        )
    return f"{who}, which is stopped" if pid == peers.stopped_holder is not None else who


def _check_certificate(config: SessionConfig) -> None:
    """Log a warning if the certificate is of another machine, so that others refuse links."""
    if config.keys is None or all(Endpoint(place).is_local for place in config.listen):
        return
    from rosz.security import certificate_names

    names = certificate_names(config.keys)
    host = socket.gethostname()
    if names and not {host, host.partition(".")[0]} & {*names}:
        _log.warning(
            "the certificate in '%s' is for %s, and this machine is '%s': others refuse links to"
            " it by that name ('rosz keys add %s' makes its own)",
            config.keys.path,
            ", ".join(f"'{name}'" for name in names if not name.endswith(".invalid")),
            host,
            host,
        )


def _name_occupied(error: TransportError, config: SessionConfig) -> TransportError:
    """Return the error to raise for an endpoint that another process may hold."""
    match = _OCCUPIED.search(str(error))
    if match is None:
        return error
    place = match[1] or match[2]
    listen, _ = places_of(config)
    endpoint = next((text for text in listen if text.partition("#")[0].endswith(place)), place)
    pid = find_holder(endpoint)
    who = "another process" if pid is None else describe_process(pid)
    return TransportError(
        f"'{endpoint}' is occupied by {who}: end it and start the core again, or name another port"
    )
