"""The Zenoh session: the one door to the network.

No Python runs on Zenoh's threads: what comes waits in channels of Zenoh's, and threads of Python
take it from there. Else a link would wait for Python's lock, and a thread of Zenoh's that wanted it
while the interpreter ends would abort the process.
"""

from __future__ import annotations

import threading
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Self

import zenoh

from rosz.session import parting
from rosz.session.asking import Asking
from rosz.session.calls import ENDING
from rosz.session.config import SessionConfig
from rosz.session.declared import Closable, mapped
from rosz.session.declaring import CONGESTION, Declaring
from rosz.session.ending import ClosedSession
from rosz.session.lingering import never_linger
from rosz.session.opening import open_raw
from rosz.session.parting import parting_from_stopped
from rosz.session.presence import Presence, marks, why_silent
from rosz.session.samples import to_timestamp
from rosz.session.segments import sweep
from rosz.session.stamp import HybridClock, Stamp

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ("Session",)


class Session(Declaring, Asking):
    """One connection to the network.

    Args:
        raw: The open Zenoh session.
        secured: Whether links beyond the machine need keys.
        rendezvous: Endpoint where the sessions of this machine meet.
    """

    def __init__(self, raw: zenoh.Session, *, secured: bool = False, rendezvous: str = "") -> None:
        self.secured = secured
        self._rendezvous = rendezvous
        self._raw = raw
        self._closing = threading.Lock()
        self._presence: Presence | None = None
        self._links: Closable | None = None
        self.zid = str(raw.zid())
        self.clock = HybridClock(self.zid)

    @classmethod
    def open(cls, config: SessionConfig) -> Session:
        """Open a session.

        Raises:
            TransportError: Nobody answers where one must, an endpoint is occupied or malformed, or
                a configuration value is refused.
            UsageError: The override text is malformed.
        """
        presence = _presence_of(config)
        try:
            raw = open_raw(config, presence)
        except BaseException:
            if presence is not None:
                presence.close()
            raise
        session = cls(raw, secured=config.keys is not None, rendezvous=config.rendezvous)
        if presence is not None:
            presence.tell(session.zid)
            session._presence = presence
        if config.mode != "client" or config.reaches_beyond:
            session._links = never_linger(session._raw)
        return session

    def stamp(self) -> Stamp:
        """Return a new stamp, later than all that this session gave or was shown."""
        return self.clock.now()

    def put(
        self,
        key: str,
        payload: bytes,
        *,
        attachment: bytes | None = None,
        stamp: Stamp | None = None,
        block: bool = True,
    ) -> None:
        """Write a value; unless told not to ``block``, wait for a slow link rather than drop it.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"write '{key}'"):
            self._raw.put(
                key,
                payload,
                attachment=attachment,
                timestamp=None if stamp is None else to_timestamp(stamp),
                congestion_control=CONGESTION[block],
            )

    def delete(
        self, key: str, *, attachment: bytes | None = None, stamp: Stamp | None = None
    ) -> None:
        """Delete a value; waits for a slow link rather than drop the deletion.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"delete '{key}'"):
            self._raw.delete(
                key,
                attachment=attachment,
                timestamp=None if stamp is None else to_timestamp(stamp),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )

    def peers(self) -> list[str]:
        """Return the ids of the sessions and routers that this one is linked to."""
        info = self._raw.info
        return sorted(str(zid) for zid in (*info.peers_zid(), *info.routers_zid()))

    def out_of_reach(self) -> set[str]:
        """Return the ids of those sessions of this machine that are stopped, and answer nobody."""
        return {mark.zid for mark in marks(self._rendezvous) if mark.is_stopped}

    def why_silent(self, *sessions: str) -> str:
        """Say which of some sessions' processes are stopped, and what to do; empty if none is."""
        return why_silent(self._rendezvous, sessions)

    @property
    def closed(self) -> bool:
        """Whether the session has been closed."""
        return isinstance(self._raw, ClosedSession)

    def disown(self, why: str) -> None:
        """Refuse everything from now on, leaving Zenoh alone: after a fork, in the child.

        Args:
            why: What the refusals say.
        """
        import ctypes

        # Zenoh's threads are not here to answer: even to free the session would wait for ever.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._raw))
        self._closing = threading.Lock()
        if self._presence is not None:
            self._presence.close()
        self._raw = ClosedSession(why)
        ENDING.set()

    def parting(self) -> AbstractContextManager[None]:
        """Return within what nothing waits for processes that are stopped: for the end.

        What is undeclared waits for room in the queue of each link, which one of these has not.
        """
        if self.closed:
            return nullcontext()
        return parting_from_stopped(self._raw, self._rendezvous)

    def close(self) -> None:
        """Close the session and all that is declared on it; again is no error."""
        with self._closing:
            if self.closed:
                return
            raw, self._raw = self._raw, ClosedSession("the session is closed")
            if self._presence is not None:
                self._presence.close()
            parting.close(raw, self._rendezvous)
            del raw
            sweep()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _presence_of(config: SessionConfig) -> Presence | None:
    """Return the mark of a session that others may want to meet."""
    if config.mode == "client" or not config.hold_rendezvous:
        return None
    return Presence(config.rendezvous, reachable=config.mode == "peer")
