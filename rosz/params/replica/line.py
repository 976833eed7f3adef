"""How writes travel: told to all, acknowledged by each, told again to who seems to miss them."""

from __future__ import annotations

import logging
import struct
import time
from collections.abc import Callable, Collection
from functools import partial
from typing import Final

from rosz.errors import DecodeError, RoszError
from rosz.lifecycle import Closable
from rosz.params.keys import Keys
from rosz.params.merge import Change
from rosz.params.paths import ROOT, Path, joined
from rosz.params.replica.acks import Acks, Pending
from rosz.params.replica.complaints import NO_PARAMETER
from rosz.params.replica.members import Members
from rosz.params.replica.state import State
from rosz.params.replica.worker import Worker
from rosz.params.wire import Batch, encode, seal, unseal
from rosz.session import Query, RawPublisher, Reply, Sample, Session, Stamp

__all__ = ("Line",)

_log = logging.getLogger("rosz.params")

_LARGE: Final = 16_384
"""Bytes of a message above which it is not read on Zenoh's thread."""

_ACK: Final = struct.Struct("<Q")
_MOST_VOICES: Final = 1000
_PATIENCE: Final = 0.25
"""Seconds after which those that have not acknowledged a write are told it once more."""


class Line:
    """The writes of one replica, going out and coming in.

    Args:
        session: The network.
        keys: Where.
        state: What takes in the writes of others.
        worker: Where large ones are read.
        kept: Calls a function once all that the state has taken in is on disk; none if it never is.
    """

    def __init__(
        self,
        session: Session,
        keys: Keys,
        state: State,
        worker: Worker,
        kept: Callable[[Callable[[], None]], None] | None,
    ) -> None:
        self.acks = Acks()
        self._session = session
        self._keys = keys
        self._state = state
        self._worker = worker
        self._kept = kept
        self._own = session.zid.encode()
        self._voices: dict[str, RawPublisher] = {}
        self._change = session.publisher(keys.change, block=True)
        self._declared: list[Closable] = [
            session.subscriber(keys.change, self._on_change, remote_only=True),
            session.subscriber(f"{keys.change}/*/**", self._on_scoped, remote_only=True),
            session.subscriber(keys.ack(session.zid), self._on_ack, remote_only=True),
            session.queryable(f"{keys.write(session.zid)}/**", self._on_retry, complete=True),
        ]

    def tell(
        self, changes: list[Change], stamp: Stamp, origin: str, members: Members, timeout: float
    ) -> tuple[str, ...]:
        """Tell all members what was written, and wait until they have it.

        Args:
            changes: What was written, of which those that lie deeper come later.
            stamp: When.
            origin: Who wrote it.
            members: Who is to have it.
            timeout: Seconds; 0 does not wait.

        Returns:
            What people call those that did not acknowledge it in time.

        Raises:
            ClosedError: The session is closed.
            TransportError: The session cannot send.
        """
        began = time.monotonic()
        deadline = began + timeout
        pending = self.acks.open(members.zids if timeout > 0 else ())
        for zid in pending.waiting - members.zids:  # which ended since they were counted
            self.acks.gone(zid)
        try:
            batch = Batch.of((stamp.time, stamp.id), origin, changes)
            data = seal(self._session.zid, pending.number, encode(batch))
            self._tell(changes, data)
            if not pending.wait(min(_PATIENCE, timeout)) and not self._are_stopped(pending):
                self._tell_again(pending, changes, data, deadline - time.monotonic())
                pending.wait(deadline - time.monotonic())
        finally:
            late = self._labels(self.acks.close(pending), members)
        if late:
            _warn(changes, late, time.monotonic() - began)
        return tuple(late)

    def gone(self, zid: str) -> None:
        """Wait for a replica no longer, and answer it no more."""
        self.acks.gone(zid)
        self._worker.submit(lambda: self._hush(zid))

    def close(self) -> None:
        """Undeclare all, and wait for nobody any more."""
        for declared in self._declared:
            declared.close()
        self.acks.give_up()
        for zid in tuple(self._voices):
            self._hush(zid)
        self._change.close()

    def _tell(self, changes: list[Change], data: bytes) -> None:
        if self._keys.scoped:
            key = self._keys.reaching(self._keys.change, (path for path, _ in changes))
            self._session.put(key, data)
        else:
            self._change.put(data)

    def _are_stopped(self, pending: Pending) -> bool:
        """Tell whether all that a write waits for will get it when they go on, and not before."""
        return self._session.out_of_reach().issuperset(pending.waiting.copy())

    def _labels(self, late: Collection[str], members: Members) -> list[str]:
        stopped = self._session.out_of_reach() if late else ()
        return sorted(members.label(zid) + " (stopped)" * (zid in stopped) for zid in late)

    def _tell_again(
        self, pending: Pending, changes: list[Change], data: bytes, timeout: float
    ) -> None:
        if timeout <= 0:
            return
        for zid in sorted(pending.waiting.copy()):
            self._session.get_async(
                self._keys.reaching(self._keys.write(zid), (path for path, _ in changes)),
                partial(self._on_confirmed, zid, pending.number),
                lambda: None,
                payload=data,
                timeout=timeout,
            )

    def _on_confirmed(self, zid: str, number: int, reply: Reply) -> None:
        if reply.ok:
            self.acks.heard(zid, number)

    def _on_change(self, sample: Sample) -> None:
        self._take(sample.payload, ROOT)

    def _on_scoped(self, sample: Sample) -> None:
        try:
            reach = self._keys.reach(sample.key, self._keys.change)
        except DecodeError as error:
            self._state.complaints.tell(NO_PARAMETER, error)
            return
        self._take(sample.payload, reach)

    def _take(self, payload: bytes, reach: Path) -> None:
        try:
            sender, number, _ = unseal(payload)
        except DecodeError as error:
            self._state.complaints.tell(NO_PARAMETER, error)
            return
        then = partial(self._acknowledge, sender, number)
        if len(payload) > _LARGE:
            self._worker.offer(lambda: self._apply(payload, reach, then))
        elif self._state.note(payload, reach):
            then()
        elif self._state.take_soon(payload, reach):
            self._settle(then)
        else:
            # What is turned away is not acknowledged, and so told once more.
            self._worker.offer(lambda: self._apply(payload, reach, then))

    def _apply(self, payload: bytes, reach: Path, then: Callable[[], None]) -> None:
        self._state.take(payload, reach)
        self._settle(then)

    def _settle(self, then: Callable[[], None]) -> None:
        """Do something as soon as what was applied is safe."""
        if self._kept is None:
            then()
        else:
            self._kept(then)

    def _acknowledge(self, sender: str, number: int) -> None:
        ack = _ACK.pack(number) + self._own
        voice = self._voices.get(sender)
        try:
            # Called on Zenoh's thread: an acknowledgement lost on a full link is asked for again,
            # but one that waits for the link would hold up all that comes in.
            if voice is not None:
                voice.put(ack)
            else:
                self._session.put(self._keys.ack(sender), ack, block=False)
                self._worker.submit(lambda: self._find_voice(sender))
        except RoszError as error:
            _log.debug("a write is not acknowledged: %s", error)

    def _find_voice(self, sender: str) -> None:
        """Declare the way back to a writer: a put on a declared key needs no search for its way."""
        if sender not in self._voices and len(self._voices) < _MOST_VOICES:
            self._voices[sender] = self._session.publisher(self._keys.ack(sender))

    def _hush(self, zid: str) -> None:
        voice = self._voices.pop(zid, None)
        if voice is not None:
            voice.close()

    def _on_ack(self, sample: Sample) -> None:
        payload = sample.payload
        zid = payload[_ACK.size :]
        if zid.isalnum():
            self.acks.heard(zid.decode(), _ACK.unpack_from(payload)[0])

    def _on_retry(self, query: Query) -> None:
        payload = query.payload or b""
        try:
            reach = self._keys.reach(query.key, self._keys.write(self._session.zid))
        except DecodeError as error:
            with query:
                query.reply_error(str(error))
            return
        done = partial(self._confirm, query)
        if not self._worker.offer(lambda: self._apply(payload, reach, done)):
            query.close()

    def _confirm(self, query: Query) -> None:
        with query:
            query.reply(query.key, b"")


def _warn(changes: list[Change], late: list[str], seconds: float) -> None:
    more = f" and {len(changes) - 1} more" if len(changes) > 1 else ""
    _log.warning(
        "'%s'%s is written, but not yet known to %s, which did not answer within %.2g s",
        joined(changes[0][0]) if changes else "/",
        more,
        ", ".join(late),
        seconds,
    )
