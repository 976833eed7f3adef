"""Finding out when a new session is linked to all its neighbours.

A peer hears of other peers from the first one that it meets, and connects to them in the
background. Until it has done so, its samples do not reach those that it is not linked to. So it
asks the sessions that it meets for *their* links, and is ready once it has all of these itself.
Sessions on other machines are left out, because routers carry its samples to them and it cannot
connect to them; so are those that are stopped, which answer nothing until they resume.
"""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.session.local_peers import LocalPeers
from rosz.session.queries import Query
from rosz.session.session import Session

_SPACE = "@rosz/links"
_POLL_SECONDS = 0.002
_LATER_POLL_SECONDS = 0.05
_QUERY_TIMEOUT = 0.5
_SILENT_SECONDS = 0.1
"""Time after which a peer that does not tell its links is one that never does, such as a command or
a node of ROS 2. Before that, its queryable may not be declared here yet, and it may know further
peers. A command, which has to be fast, does not wait for that."""
_BUSY_SECONDS = 1.0
"""The same for a peer that is registered on this machine, which tells them once it has time."""
_MOST_PEERS = 60
"""Peers from which on a newcomer is told of cores, as every two sessions of a mesh are linked."""
_ADVICE = "use a core for so many nodes (run 'rosz core', and start nodes with ROSZ_MODE=client)"

_log = logging.getLogger("rosz.session")


class MeshReadiness:
    """Tells when a session is linked to all its neighbours.

    Args:
        session: The session.
        timeout: Time in seconds after which the session counts as ready in any case; 0 if it is
            ready now.
        link_timeout: Time in seconds without a new link after which no more is expected: by then
            Zenoh has given up each attempt, and a warning says so. Without it, as in a command,
            the session waits for no more links than until it is ready.
        stop: Event that ends the waiting.
        mesh: Whether the session links to all its neighbours, rather than to one as a client does.
        everywhere: Whether it also links to peers of other machines, as with multicast.

    Attributes:
        ready: Set when the session is ready, or the timeout is over.
        linked: Set when the session is ready, or no more links are expected.
    """

    def __init__(
        self,
        session: Session,
        timeout: float,
        stop: threading.Event,
        *,
        link_timeout: float = 0.0,
        mesh: bool = True,
        everywhere: bool = False,
    ) -> None:
        self.ready: threading.Event = threading.Event()
        self.linked: threading.Event = threading.Event()
        self._session = session
        self._timeout = timeout
        self._link_timeout = link_timeout
        self._stop = stop
        self._mesh = mesh
        self._key = links_key("*", machine="*" if everywhere else "")
        self._replied: set[str] = set()
        self._lock = threading.RLock()  # a signal handler may call `when_linked` meanwhile
        self._callbacks: list[Callable[[], None]] = []
        if timeout:
            threading.Thread(target=self._run, name="rosz-mesh", daemon=True).start()
        else:
            self.ready.set()
            self.linked.set()

    def when_linked(self, callback: Callable[[], None]) -> None:
        """Call a function when `linked` is set, or now if it is."""
        with self._lock:
            if not self.linked.is_set():
                self._callbacks.append(callback)
                return
        callback()

    def _run(self) -> None:
        try:
            self._wait()
        except RoszError as error:
            if not self._stop.is_set():
                _log.warning("cannot tell whether all peers are linked: %s", error)
        finally:
            with self._lock:
                self.ready.set()
                self.linked.set()
                callbacks, self._callbacks = self._callbacks, []
            for callback in callbacks:
                try:
                    callback()
                except RoszError as error:
                    _log.warning("cannot send the held samples: %s", error)

    def _wait(self) -> None:
        began = latest = time.monotonic()
        peers: list[str] = []
        missing: set[str] = set()
        pause = _POLL_SECONDS
        while not self._stop.wait(pause):
            now_linked = self._session.peers()
            now = time.monotonic()
            if now_linked != peers:
                peers, latest = now_linked, now
            missing = self._missing(_QUERY_TIMEOUT) if now_linked and self._mesh else set()
            if now_linked and not missing and not self._may_learn_more(now_linked, now - latest):
                self._warn_of_many(len(now_linked))
                return
            if now - latest >= _SILENT_SECONDS:
                pause = _LATER_POLL_SECONDS
            if now - began >= self._timeout:
                self.ready.set()
            if now - latest >= max(self._timeout, self._link_timeout):
                break
        if missing and self._link_timeout and not self._stop.is_set():
            _log.warning(
                "not linked to %d other session(s) of this machine within %g s: what is published"
                " does not reach them; %s",
                len(missing),
                self._link_timeout,
                _ADVICE,
            )

    def _may_learn_more(self, linked: list[str], seconds: float) -> bool:
        """Tell whether some peers may yet tell their links, so long after the newest link."""
        silent = set(linked) - self._replied
        if not (silent and self._link_timeout and self._mesh and seconds < _BUSY_SECONDS):
            return False
        if seconds < _SILENT_SECONDS:
            return True
        nearby = LocalPeers.read(self._session.others.rendezvous)
        running = {peer.zid for peer in nearby if not peer.is_stopped}
        return not silent.isdisjoint(running.intersection(self._session.peers(routers=False)))

    def _warn_of_many(self, peers: int) -> None:
        """Advise a newcomer to a large mesh, each of whose sessions it costs a link."""
        if self._mesh and peers >= _MOST_PEERS:
            _log.warning(
                "%d other sessions are here, each linked to all; more may not find each other: %s",
                peers,
                _ADVICE,
            )

    def _missing(self, timeout: float) -> set[str]:
        """Return the sessions that neighbours are linked to, and that this one is not yet."""
        linked: set[str] = set()
        for reply in self._session.get(self._key, timeout=min(timeout, _QUERY_TIMEOUT)):
            if reply.ok:
                self._replied.add(reply.key.rpartition("/")[2])
                try:
                    linked.update(msgspec.msgpack.decode(reply.payload, type=list[str]))
                except msgspec.DecodeError as error:
                    _log.warning("no list of links from '%.100s': %s", reply.key, error)
        missing = linked - {self._session.zid, *self._session.peers()}
        return missing - self._session.out_of_reach() if missing else missing


def links_key(zid: str, *chunks: str, machine: str = "") -> str:
    """Return the key at which a session replies to queries about its links.

    Args:
        zid: The id of the session; ``*`` for all.
        chunks: The subject of the query; all links when not given.
        machine: The id of its machine; this one when not given, ``*`` for all.
    """
    return "/".join((_SPACE, machine or machine_id(), zid, *chunks))


def serve_links(session: Session) -> Closable:
    """Reply to queries for the links of a session, until closed."""
    key = links_key(session.zid)

    def reply(query: Query) -> None:
        # If the session closes meanwhile, the querier notices that.
        with query, suppress(RoszError):
            query.reply(key, msgspec.msgpack.encode(session.peers()))

    return session.queryable(key, reply)


@cache
def machine_id() -> str:
    """Return the id of this machine; processes with the same id reach each other by loopback."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot}-{Path('/proc/self/ns/net').stat().st_ino}"
    except OSError:  # not Linux: there are no namespaces either
        return socket.gethostname().lower() or "localhost"
