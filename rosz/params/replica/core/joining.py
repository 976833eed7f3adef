"""Joining the other replicas: getting what they have from the first that has joined and replies."""

from __future__ import annotations

import logging
from typing import Final

from rosz.params.replica.core.comparisons import Compared, Comparisons
from rosz.params.replica.core.effects import FindStopped
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.work import Work

NEXT: Final = "query the next"
MORE: Final = "find more"
_JOINING: Final = "joining"
_NEXT_AFTER: Final = 0.3
"""Seconds after which a joining replica asks the next replica as well; twice as many each time, as
many that start at once would else keep all others busy."""

_TIMEOUT: Final = 30.0
_WARN_AFTER: Final = 5.0
"""Seconds after which a replica that cannot join warns; 100 that start at once need their time."""

_MORE_TIMEOUT: Final = 0.5


class Joining:
    """The way of a replica to what the others have.

    Args:
        work: The step.
        members: The other replicas.
        comparisons: The comparisons with them.
        call: Number of the call that waits for the end.

    Attributes:
        done: Whether it has ended.
    """

    def __init__(self, work: Work, members: Members, comparisons: Comparisons, call: int) -> None:
        self.done: bool = False
        self._work = work
        self._members = members
        self._comparisons = comparisons
        self._call = call
        self._began = work.now.seconds
        self._asked: list[str] = []
        self._open: set[str] = set()
        self._looking = False
        self._looked = False
        self._warned = False

    def query_next(self) -> None:
        """Compare with the next replica, or look for more than seeds, or give up."""
        if self.done or self._looking:
            return
        unasked = self._unasked()
        if unasked:
            zid = unasked[0]
            self._asked.append(zid)
            self._open.add(zid)
            self._comparisons.start(zid, 0, self._call)
            self._wait()
        elif not self._open:
            self._look_for_more()

    def on_compared(self, compared: Compared) -> None:
        """Handle the end of a comparison."""
        self._open.discard(compared.zid)
        if compared.good and compared.joined:
            self._end()
        else:
            self.query_next()

    def on_timer(self, number: int) -> None:
        """Handle that those that were asked let this one wait."""
        if self.done or number != len(self._asked):
            return
        passed = self._work.now.seconds - self._began
        if passed >= _TIMEOUT:
            self._warn(passed)
            self._end()
        elif self._unasked():
            self.query_next()
        else:
            self._wait()
            self._work.do(FindStopped())

    def on_stopped(self, zids: frozenset[str]) -> None:
        """Give up, after a look for more, if all replicas are stopped; warn if it takes long."""
        passed = self._work.now.seconds - self._began
        are_stopped = zids >= self._members.zids
        if self.done or self._looking or not (are_stopped or passed > _WARN_AFTER):
            return
        if not self._looked:
            self._look_for_more()
            return
        if not self._warned:
            self._warn(passed)
        if are_stopped:
            self._end()

    def on_found(self) -> None:
        """Handle that all replicas are known, or that the time to find them is over."""
        if self._looking and not self.done:
            self._looking = False
            if self._unasked() or self._open:
                self.query_next()
            else:
                self._end()

    def _look_for_more(self) -> None:
        """Look for replicas other than seeds."""
        if self._looked:
            self._end()
            return
        self._looked = self._looking = True
        if self._members.follow(_JOINING):
            self.on_found()
        else:
            self._work.later(_MORE_TIMEOUT, MORE)

    def _unasked(self) -> list[str]:
        return [member.zid for member in self._members.all() if member.zid not in self._asked]

    def _wait(self) -> None:
        seconds = min(_NEXT_AFTER * 2 ** (len(self._asked) - 1), _WARN_AFTER)
        self._work.later(seconds, NEXT, len(self._asked))

    def _warn(self, seconds: float) -> None:
        self._warned = True
        labels = ", ".join(self._members.label(zid) for zid in self._asked)
        self._work.log(
            logging.WARNING, f"no replica of the parameters answered in {seconds:.2g} s: {labels}"
        )

    def _end(self) -> None:
        self.done = True
        self._members.unfollow(_JOINING)
