"""The end of a replica: it hands over the writes that nobody else has, or says which are lost."""

from __future__ import annotations

import logging

import msgspec

from rosz.params.paths import Path
from rosz.params.replica.core.calls import CALL, Calls
from rosz.params.replica.core.comparisons import Compared, Comparisons
from rosz.params.replica.core.deliveries import Deliveries
from rosz.params.replica.core.effects import Answer, Leave
from rosz.params.replica.core.events import CloseCalled
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.work import Work, named


class Ending(msgspec.Struct, eq=False):
    """The end of a replica, which begins with `CloseCalled`.

    Args:
        work: Gives the time of the step, and collects its effects.
        store: The writes of this replica.
        members: The other replicas.
        deliveries: The own batches.
        comparisons: The comparisons with the others.
        calls: Calls that wait for others.
    """

    _work: Work
    _store: Store
    _members: Members
    _deliveries: Deliveries
    _comparisons: Comparisons
    _calls: Calls
    _call: int = 0
    _asked: set[str] = msgspec.field(default_factory=set)

    def begin(self, event: CloseCalled) -> None:
        """Begin to hand over, within the time limit of the call."""
        self._call = event.call
        self._store.on_retry()
        self._work.later(event.timeout, CALL, event.call, event.call)
        self.hand_over()

    def hand_over(self) -> None:
        """Let another replica have the writes that nobody else has, if the replica ends."""
        if not self._call:
            return
        unfit = self._asked | self._deliveries.lagging | self._deliveries.stopped
        candidates = [member.zid for member in (*self._members.seeds(), *self._members.all())]
        zid = next((zid for zid in candidates if zid not in unfit), "")
        if self._store.disk.is_current or not self._unshared():
            self._leave()
        elif zid:
            self._asked.add(zid)
            self._comparisons.start(zid, self._call)
        elif not (self._comparisons.any_open or self._members.awaited()):
            self._leave()

    def on_compared(self, compared: Compared) -> None:
        """Handle the end of a comparison."""
        if compared.waiter == self._call:
            self.hand_over()

    def on_acknowledged(self) -> None:
        """Handle an acknowledgement of an own batch."""
        if self._call and not self._unshared():
            self._leave()

    def on_timer(self, number: int) -> None:
        """Leave if the timer is that of the end."""
        if self._call == number:
            self._leave()

    def _unshared(self) -> list[Path]:
        """Return the paths of own writes that only this replica has, and that none replaced."""
        source = self._store.history.source
        writes = ((path, stamp, source(path)) for path, stamp in self._deliveries.unshared)
        return [path for path, stamp, put in writes if put and (put.time, put.clock) == stamp]

    def _leave(self) -> None:
        call, self._call = self._call, 0
        unshared, members = self._unshared(), self._members
        # If all others have ended in the ordinary way, the store ends with the last one.
        unreached = members.zids or members.lost_all
        if unshared and unreached and not self._store.disk.is_current:
            self._work.log(
                logging.WARNING,
                f"{named(unshared)} is lost with this process, which ends: no other"
                " that holds the parameters could be reached",
            )
        self._deliveries.abandon()
        self._calls.abandon()
        self._work.do(Leave())
        self._work.do(Answer(call, True))
