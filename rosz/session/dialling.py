"""The endpoints that a session dials beyond its rendezvous, and which of them are reached.

Zenoh dials for as long as a session is open, and reports nothing. So a thread compares the links of
the session with its endpoints once a second, and logs each change. The session also replies to
queries for the endpoints that it waits for, so that commands and ``rosz doctor`` can name them.
"""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Iterator

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.session.config import SessionConfig, addresses_of, is_own
from rosz.session.mesh import links_key
from rosz.session.opening import places_of, why_refused_by_keys
from rosz.session.probe import SILENT, why_refused
from rosz.session.queries import Query
from rosz.session.session import Session
from rosz.wire import Endpoint

_PAUSE = 1.0
"""Seconds between two looks at the links."""
_FIRST_LOOK = 2.0
_IDENTIFY_TIMEOUT = 1.0
_IDENTIFY_EVERY = 10
"""Number of looks from one attempt to the next to find out who answers at an endpoint."""

_log = logging.getLogger("rosz.session")


class Waiting(msgspec.Struct, frozen=True, order=True):
    """An endpoint that a session dials and does not reach.

    Attributes:
        host: The name of the machine that dials.
        endpoint: The endpoint.
    """

    host: str
    endpoint: str


class Dialling:
    """Logs which of the endpoints that a session dials are reached, until closed.

    Args:
        session: The session.
        config: Its configuration.
    """

    def __init__(self, session: Session, config: SessionConfig) -> None:
        self._session = session
        self._config = config
        self._closing = threading.Event()
        self._looked = threading.Event()
        self._reached: dict[str, bool] = {}
        self._logged: dict[str, bool] = {}
        self._answering: dict[str, str] = {}
        self._served: Closable | None = None
        if config.connect and not config.must_connect:
            self._served = session.queryable(links_key(session.zid, "waiting"), self._reply)
            threading.Thread(target=self._run, name="rosz-dialling", daemon=True).start()
        else:
            self._looked.set()

    def announce(self) -> dict[str, bool]:
        """Return the endpoints that the session dials, each with whether it is reached.

        The caller prints them, so only later changes are logged.
        """
        self._looked.wait(_FIRST_LOOK)
        self._logged.update(self._reached)
        return self._reached

    def close(self) -> None:
        """Stop looking; a second call has no effect."""
        self._closing.set()
        served, self._served = self._served, None
        if served is not None:
            served.close()

    def _reply(self, query: Query) -> None:
        host = socket.gethostname()
        self._looked.wait(_FIRST_LOOK)
        waiting = [Waiting(host, endpoint) for endpoint, yes in self._reached.items() if not yes]
        with query:
            query.reply(links_key(self._session.zid, "waiting"), msgspec.msgpack.encode(waiting))

    def _run(self) -> None:
        try:
            self._watch()
        except RoszError as error:
            if not self._closing.is_set():
                _log.warning("cannot tell which endpoints are reached: %s", error)
        finally:
            self._looked.set()

    def _watch(self) -> None:
        dialled = list(_beyond(self._config))
        if self._config.mode == "client" and dialled:
            dialled = [" or ".join(dialled)]
        look = 0
        while dialled and not self._closing.is_set():
            links = self._session.links()
            identify = look % _IDENTIFY_EVERY == 1
            self._reached = {
                text: self._is_reached(text, links, identify=identify) for text in dialled
            }
            self._looked.set()
            for endpoint, reached in self._reached.items():
                # A link may take some time to come about.
                refused = look == 1 and self._logged.get(endpoint) is reached is False
                if refused and (reason := self._why_refused_by_keys(endpoint)):
                    _log.warning("no link to %s: %s", endpoint, reason)
                if reached or look:
                    self._log_change(endpoint, self._logged.get(endpoint), reached)
                    self._logged[endpoint] = reached
            look += 1
            self._closing.wait(_PAUSE)

    def _is_reached(self, endpoint: str, links: dict[str, list[str]], *, identify: bool) -> bool:
        """Tell whether there is a link to the session that answers at an endpoint.

        It may be a link by another address, since Zenoh opens no further one to the same session.
        """
        if self._config.mode == "client":
            return bool(links)
        if self._answering.get(endpoint) in links:
            return True
        if zid := linked_session(endpoint, links):
            self._answering[endpoint] = zid
            return True
        if identify and not self._closing.is_set():
            self._answering[endpoint] = who_answers(endpoint, self._config, _IDENTIFY_TIMEOUT)
        return self._answering.get(endpoint) in links

    def _log_change(self, endpoint: str, before: bool | None, now: bool) -> None:
        if before is now or (before is None and now):
            return
        if now:
            _log.warning("connected to %s", endpoint)
        elif before:
            _log.warning("the link to %s is lost: waiting for it", endpoint)
        else:
            reason = self._why_refused_by_keys(endpoint) or why_refused(endpoint)
            _log.warning("waiting for %s: %s", endpoint, reason or SILENT)

    def _why_refused_by_keys(self, endpoint: str) -> str:
        return why_refused_by_keys(Endpoint(endpoint), self._config.keys)


def linked_session(endpoint: str, links: dict[str, list[str]]) -> str:
    """Return the id of the session that is linked at an endpoint; empty if none is.

    Args:
        endpoint: The endpoint.
        links: The links of a session; see `Session.links`.
    """
    place = Endpoint(endpoint)
    names = {(name, place.port) for name in addresses_of(place.host)} if place.port else set()
    for zid, ends in links.items():
        for end in map(Endpoint, ends):
            if end.address == place.address or (end.host, end.port) in names:
                return zid
    return ""


def find_waiting(session: Session, timeout: float, *, everywhere: bool = False) -> list[Waiting]:
    """Return the endpoints that cores and nodes dial and do not reach.

    Args:
        session: The session to query with.
        timeout: Time limit in seconds.
        everywhere: Whether to query all machines rather than this one.
    """
    waiting: set[Waiting] = set()
    key = links_key("*", "waiting", machine="*" if everywhere else "")
    for reply in session.get(key, timeout=timeout):
        if reply.ok:
            try:
                waiting.update(msgspec.msgpack.decode(reply.payload, type=list[Waiting]))
            except msgspec.DecodeError as error:
                _log.warning("no list of endpoints from '%.100s': %s", reply.key, error)
    return sorted(waiting)


def who_answers(endpoint: str, config: SessionConfig, timeout: float) -> str:
    """Return the id of the Zenoh session that answers at an endpoint; empty if none does.

    Args:
        endpoint: The endpoint.
        config: The configuration whose keys and further settings to use.
        timeout: Time limit in seconds.
    """
    if why_refused(endpoint, timeout):
        return ""
    client = SessionConfig(
        mode="client",
        rendezvous=endpoint,
        must_connect=True,
        open_timeout=timeout,
        keys=config.keys,
    )
    try:
        with Session.open(client) as session:
            return next(iter(session.peers()), "")
    except RoszError:
        return ""


def _beyond(config: SessionConfig) -> Iterator[str]:
    """Yield the endpoints that a session dials and that are not its own or of its rendezvous."""
    listen, connect = places_of(config)
    own = [Endpoint(text) for text in (config.rendezvous, *listen)]
    for text in connect:
        endpoint = Endpoint(text)
        same = any(
            endpoint.address == place.address
            or (place.port and place.port == endpoint.port and is_own(endpoint.host))
            for place in own
        )
        if not same:
            yield text
