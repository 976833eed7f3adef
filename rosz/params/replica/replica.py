"""A process's own copy of the parameter store.

It begins by listening, then asks the others for all they have, and serves once it has that. Reads
are look-ups in its own tree. A write is applied here, told to all others in one message, and done
when each of them has acknowledged it. Who does not answer is told once more, directly, and then
named in a warning: the write stands, and that replica gets it when it answers again.
"""

from __future__ import annotations

import os
import socket
import sys
import threading
from collections.abc import Iterable
from pathlib import PurePath
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Final, Self

import msgspec

from rosz.errors import ClosedError, ParamError
from rosz.lifecycle import Closable
from rosz.params.keys import Keys, Member
from rosz.params.merge import Change, condense, spread
from rosz.params.paths import split
from rosz.params.replica.keeper import Keeper
from rosz.params.replica.line import Line
from rosz.params.replica.members import Members
from rosz.params.replica.mirror import Mirror
from rosz.params.replica.reading import Reading, not_found
from rosz.params.replica.saver import Keep, Saver
from rosz.params.replica.serve import Server
from rosz.params.replica.state import State
from rosz.params.replica.sync import Synchroniser
from rosz.params.replica.worker import Worker
from rosz.params.tree import MISSING, lookup
from rosz.params.values import normalise
from rosz.params.writes import DELETED
from rosz.session import Session, Stamp, clamp_timeout

__all__ = ("ACKNOWLEDGED_BY", "Outcome", "Replica", "process_label")

ACKNOWLEDGED_BY: Final = 2.0
"""Seconds that a write waits for the other replicas when not told otherwise."""

_SETTLED_BY: Final = 2.0
_TOKENS_BY: Final = 0.5


class Outcome(msgspec.Struct, frozen=True):
    """What became of a write, which stands in any case.

    Attributes:
        time: Its time, in nanoseconds since the epoch.
        slow: Replicas that did not acknowledge it in time, for people.
    """

    time: int
    slow: tuple[str, ...] = ()


def process_label() -> str:
    """Return what people call this process: its program, number and host."""
    program = PurePath(sys.argv[0]).name if sys.argv and sys.argv[0] else "python"
    # The name of a file may be no UTF-8, but others are told of it.
    program = program.encode(errors="surrogateescape").decode(errors="replace")
    return f"{program} (pid {os.getpid()} on {socket.gethostname()})"


class Replica(Reading):
    """The parameter store, as one process holds it. Safe for threads.

    Opening it joins the others, which takes a few milliseconds, or up to seconds where those that
    should answer do not.

    Args:
        session: The network; stays open when the replica closes.
        domain: The ROS domain.
        label: What people call this process, in warnings and as the origin of its writes.
        settled: Set when the session is linked to all its neighbours; not waited for when missing.
        keep: Where writes outlive the process.

    Attributes:
        label: What people call this process.
        zid: Its session.

    Raises:
        ClosedError: The session is closed.
        TransportError: The session cannot declare what it takes.
    """

    def __init__(
        self,
        session: Session,
        domain: int = 0,
        *,
        label: str = "",
        settled: threading.Event | None = None,
        keep: Keep | None = None,
    ) -> None:
        super().__init__(State(session.clock))
        self.label = label or process_label()
        self.zid = session.zid
        self._session = session
        self._own = Member(session.stamp().time, session.zid, self.label)
        self._closed = False
        self._saver = self._load(keep)
        self._worker = Worker("rosz-params")
        keys = Keys(domain, scoped=session.secured)
        kept = self._saver.when_safe if self._saver is not None else None
        self._line = Line(session, keys, self._state, self._worker, kept)
        self._mirror = Mirror(session, keys, self._state, self._worker)
        self._members = Members(session, keys)
        self._sync = Synchroniser(session, keys, self._state, self._members, self._worker)
        server = Server(self, keys, self._state.stamp, self._worker, lambda: self._sync.ready)
        self._declared: list[Closable] = [
            session.queryable(keys.sync(session.zid), self._sync.serve, complete=True),
            session.queryable(f"{keys.tell(session.zid)}/**", self._sync.serve_told, complete=True),
            session.queryable(keys.ask(session.zid), server.serve, complete=True),
            session.queryable(f"{keys.set(session.zid)}/**", server.serve_writes, complete=True),
        ]
        if settled is not None:
            settled.wait(_SETTLED_BY)
        self._members.follow(self._on_member, _TOKENS_BY)
        self._token = session.token(keys.token(self._own))
        self._join()
        Keeper(self._own, self._sync, self._mirror, self._trim)

    def set(
        self, name: str, value: object, *, origin: str = "", timeout: float = ACKNOWLEDGED_BY
    ) -> Outcome:
        """Set a global name; a dict replaces all that was below it.

        Args:
            name: Global name.
            value: What a parameter may hold.
            origin: Who sets it; this process when not given.
            timeout: Seconds to wait for the other replicas.

        Raises:
            ParamError: The value is none, or the root is to be no dict.
            InvalidName: It is no global name.
            ClosedError: The replica or the session is closed.
        """
        changes: list[Change] = [(split(name), normalise(value, name))]
        return self.write(changes, origin=origin, timeout=timeout)

    def merge(
        self, name: str, value: object, *, origin: str = "", timeout: float = ACKNOWLEDGED_BY
    ) -> Outcome:
        """Set a global name as ROS 1's command line does: a dict leaf by leaf, as one change.

        Raises:
            ParamError: The value is none, or the root is to be no dict.
            InvalidName: It, or a key, is no name.
            ClosedError: The replica or the session is closed.
        """
        changes = condense(spread(name, normalise(value, name)))
        return self.write(changes, origin=origin, timeout=timeout)

    def delete(self, name: str, *, origin: str = "", timeout: float = ACKNOWLEDGED_BY) -> Outcome:
        """Delete a global name and all below it; its parent stays, even empty.

        Raises:
            ParamNotFound: It is not set.
            ParamError: It is the root.
            InvalidName: It is no global name.
            ClosedError: The replica or the session is closed.
        """
        path = split(name)
        if not path:
            raise ParamError("'/' cannot be deleted; set it to {} to delete all parameters")
        if lookup(self._state.root, path) is MISSING:
            raise not_found(self._state.root, path)
        return self.write([(path, DELETED)], origin=origin, timeout=timeout)

    def write(
        self,
        changes: Iterable[Change],
        *,
        origin: str = "",
        stamp: Stamp | None = None,
        timeout: float = ACKNOWLEDGED_BY,
    ) -> Outcome:
        """Make a batch of changes, which every replica applies as one.

        Args:
            changes: Paths with values already normalised, or `DELETED`; of two of which one lies
                below the other, the upper one comes first (`rosz.params.condense`).
            origin: Who makes them; this process when not given.
            stamp: When they were made, if not now.
            timeout: Seconds to wait for the other replicas.

        Raises:
            ParamError: A change has no meaning in the tree; nothing has changed then.
            DecodeError: The stamp given lies years ahead; nothing has changed then.
            ClosedError: The replica or the session is closed.
            UsageError: The timeout is no number; nothing has changed then.
        """
        timeout = clamp_timeout(timeout)
        if self._closed:
            raise ClosedError("the parameter store of this process is closed")
        batch = list(changes)
        if not batch:
            return Outcome(0)
        origin = origin or self.label
        stamp, step = self._state.write(batch, origin, stamp)
        slow = self._line.tell(batch, stamp, origin, self._members, timeout)
        self._mirror.show(step)
        self._wait_until_kept(timeout)
        return Outcome(stamp.time, slow)

    def members(self) -> list[Member]:
        """Return the other replicas that are alive, the oldest first."""
        return self._members.all()

    def compare(self, timeout: float) -> bool:
        """Compare with all other replicas and settle what differs.

        Args:
            timeout: Seconds.

        Returns:
            Whether all of them answered in time.
        """
        timeout = clamp_timeout(timeout)
        answers: SimpleQueue[bool] = SimpleQueue()
        expected = self._sync.compare_with_all(answers.put)
        try:
            return all(answers.get(timeout=timeout) for _ in range(expected))
        except Empty:
            return False

    def digest(self) -> bytes:
        """Return the fingerprint of all writes: replicas that hold the same have the same."""
        return self._state.digest()

    @property
    def closed(self) -> bool:
        """Whether it is closed."""
        return self._closed

    def disown(self) -> None:
        """Refuse every write from now on, touching neither threads nor links: after a fork."""
        self._closed = True

    def close(self) -> None:
        """Leave the others; again is no error."""
        if self._closed:
            return
        self._closed = True
        self._token.close()
        for declared in self._declared:
            declared.close()
        self._line.close()
        self._members.close()
        self._worker.close()
        self._mirror.close()
        self._state.watchers.close()
        if self._saver is not None:
            self._saver.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "closed" if self._closed else f"{len(self._members.zids)} others"
        return f"<Replica of {len(self._state)} writes, {state}>"

    def _load(self, keep: Keep | None) -> Saver | None:
        if keep is None:
            return None
        saver = Saver(keep)
        if self._state.restore(saver.load()):
            saver.trim(self._state.writes)
        self._state.feed(saver.take)
        return saver

    def _trim(self) -> None:
        if self._saver is not None:
            self._saver.trim(self._state.writes)

    def _join(self) -> None:
        known = self._members.zids
        if known:
            self._sync.join()
        else:
            self._state.restore(self._mirror.restore())
            self._sync.ready = True
        for member in self._members.all():
            if member.zid not in known:
                self._on_member(member, True)

    def _on_member(self, member: Member, alive: bool) -> None:
        if not alive:
            self._line.gone(member.zid)
            self._sync.gone(member.zid)
        elif self._sync.ready and member < self._own:
            self._sync.meet(member)

    def _wait_until_kept(self, timeout: float) -> None:
        if self._saver is not None and timeout > 0:
            safe = threading.Event()
            self._saver.when_safe(safe.set)
            safe.wait(timeout)
