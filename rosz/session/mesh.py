"""Finding out when a young session is linked to everybody that the others are linked to.

A peer hears of the other peers from the one it meets first, and connects to them in the background.
What it publishes before that is done misses those it is not linked to yet. So it asks whom it
meets for *their* links, and is ready once it has all of them itself. Those of other machines, to
whom routers carry what it says, listen where it cannot reach them, and are left out; and so are
those that are stopped, who answer nobody until they go on.
"""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import RoszError
from rosz.session.queries import Query

if TYPE_CHECKING:
    from rosz.lifecycle import Closable
    from rosz.session.session import Session

__all__ = ("MeshReadiness", "place", "serve_links")

_SPACE = "@rosz/links"
_POLL = 0.002
_ASK_TIMEOUT = 0.5

_log = logging.getLogger("rosz.session")


class MeshReadiness:
    """A session on its way to all its neighbours; others are told of its own links meanwhile.

    Args:
        session: It.
        timeout: Seconds after which it counts as ready, come what may; 0 if it is already.
        stop: Ends the waiting when set.
        mesh: Whether it links to all its neighbours, rather than to one as a client does.
        everywhere: Whether peers of other machines can be reached as well, as by multicast.

    Attributes:
        ready: Set in the end.
    """

    def __init__(
        self,
        session: Session,
        timeout: float,
        stop: threading.Event,
        *,
        mesh: bool = True,
        everywhere: bool = False,
    ) -> None:
        self.ready = threading.Event()
        self._session = session
        self._timeout = timeout
        self._stop = stop
        self._mesh = mesh
        self._asked = f"{_SPACE}/{'*' if everywhere else place()}/*"
        self._lock = threading.RLock()  # a signal handler may ask in between
        self._waiting: list[Callable[[], None]] = []
        if timeout:
            threading.Thread(target=self._run, name="rosz-settle", daemon=True).start()
        else:
            self.ready.set()

    def when_ready(self, callback: Callable[[], None]) -> None:
        """Have a function called when it is, or at once if it is already."""
        with self._lock:
            if not self.ready.is_set():
                self._waiting.append(callback)
                return
        callback()

    def _run(self) -> None:
        try:
            self._settle()
        except RoszError as error:
            if not self._stop.is_set():
                _log.warning("cannot tell whether all peers are linked: %s", error)
        finally:
            with self._lock:
                self.ready.set()
                waiting, self._waiting = self._waiting, []
            for callback in waiting:
                _attempt(callback)

    def _settle(self) -> None:
        deadline = time.monotonic() + self._timeout
        while (left := deadline - time.monotonic()) > 0 and not self._stop.wait(_POLL):
            if self._session.peers() and (not self._mesh or not self._missing(left)):
                return

    def _missing(self, timeout: float) -> set[str]:
        """Return those that it could be linked to, and is not."""
        missing = self._neighbours(timeout) - {self._session.zid, *self._session.peers()}
        return missing - self._session.out_of_reach() if missing else missing

    def _neighbours(self, timeout: float) -> set[str]:
        """Return everybody that those who are linked to this session are linked to."""
        found: set[str] = set()
        for reply in self._session.get(self._asked, timeout=min(timeout, _ASK_TIMEOUT)):
            if reply.ok:
                try:
                    found.update(msgspec.msgpack.decode(reply.payload, type=list[str]))
                except msgspec.DecodeError as error:
                    _log.warning("no list of links from '%.100s': %s", reply.key, error)
        return found


def _attempt(callback: Callable[[], None]) -> None:
    try:
        callback()
    except RoszError as error:
        _log.warning("cannot send what was held: %s", error)


def serve_links(session: Session) -> Closable:
    """Tell others whom a session is linked to."""

    def answer(query: Query) -> None:
        with query:
            try:
                query.reply(_own_key(session), msgspec.msgpack.encode(session.peers()))
            except RoszError:
                return  # the session closed meanwhile; whoever asked sees that it is gone

    return session.queryable(_own_key(session), answer)


def _own_key(session: Session) -> str:
    return f"{_SPACE}/{place()}/{session.zid}"


@cache
def place() -> str:
    """Return what all have in common who can reach each other by loopback."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot}-{Path('/proc/self/ns/net').stat().st_ino}"
    except OSError:  # another system than Linux: no namespaces either
        return socket.gethostname().lower() or "localhost"
