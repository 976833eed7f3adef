"""The calls of the process that wait for the other replicas to be known, or to be compared with."""

from __future__ import annotations

from typing import Final

import msgspec

from rosz.params.replica.core.comparisons import Compared, Comparisons
from rosz.params.replica.core.effects import Answer
from rosz.params.replica.core.events import CompareCalled, FollowCalled
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.work import Work

CALL: Final = "call"
_READER: Final = "reader"


class _Call(msgspec.Struct):
    """A call that waits for others.

    Attributes:
        number: Number of the call.
        compares: Whether it compares with all once they are known.
        open: Sessions that it compares with.
        good: Whether all comparisons so far went well.
    """

    number: int
    compares: bool
    open: set[str]
    good: bool = True


class Calls:
    """All calls that wait.

    Args:
        work: Gives the time of the step, and collects its effects.
        members: The other replicas.
        comparisons: The comparisons with them.
    """

    def __init__(self, work: Work, members: Members, comparisons: Comparisons) -> None:
        self._work = work
        self._members = members
        self._comparisons = comparisons
        self._open: dict[int, _Call] = {}

    def begin(self, event: FollowCalled | CompareCalled) -> None:
        """Begin to wait until all others are known, and to compare with them if that is asked."""
        call = _Call(event.call, isinstance(event, CompareCalled), set())
        self._open[call.number] = call
        self._work.later(event.timeout, CALL, call.number, call.number)
        if self._members.follow(_READER):
            self._on_all_known(call)

    def on_members_known(self) -> None:
        """Handle that all others are known."""
        for call in list(self._open.values()):
            if not call.open:
                self._on_all_known(call)

    def on_compared(self, compared: Compared) -> None:
        """Handle the end of a comparison."""
        call = self._open.get(compared.waiter)
        if call is not None:
            call.open.discard(compared.zid)
            call.good = call.good and compared.good and compared.joined
            if not call.open:
                self.end(call.number, good=call.good)

    def end(self, number: int, *, good: bool) -> None:
        """Answer a call, if it waits."""
        if self._open.pop(number, None) is not None:
            self._work.do(Answer(number, good))

    def abandon(self) -> None:
        """Answer all calls, since the replica ends."""
        for number in list(self._open):
            self.end(number, good=False)

    def _on_all_known(self, call: _Call) -> None:
        if call.compares:
            call.open = set(self._members.zids)
            for zid in sorted(call.open):
                self._comparisons.start(zid, call.number)
        if not call.open:
            self.end(call.number, good=True)
