"""A copy of the store that only listens: for those who watch and want nobody to wait for them."""

from __future__ import annotations

from types import TracebackType
from typing import Final, Self

from rosz.errors import DecodeError, NoReplica
from rosz.params.keys import Keys, Member
from rosz.params.replica.complaints import NO_PARAMETER
from rosz.params.replica.members import Members
from rosz.params.replica.reading import Reading
from rosz.params.replica.state import State
from rosz.params.replica.sync import Synchroniser
from rosz.params.replica.worker import Worker
from rosz.session import Sample, Session

__all__ = ("Follower",)

_COMPARE_EVERY: Final = 5.0


class Follower(Reading):
    """The store as replicas hold it, followed without being one.

    Args:
        session: The network; stays open when the follower closes.
        domain: The ROS domain.
        timeout: Seconds to look for replicas.

    Raises:
        NoReplica: There is none.
        ClosedError: The session is closed.
    """

    def __init__(self, session: Session, domain: int, timeout: float) -> None:
        super().__init__(State(session.clock))
        keys = Keys(domain, scoped=session.secured)
        self._worker = Worker("rosz-params")
        self._members = Members(session, keys)
        self._sync = Synchroniser(session, keys, self._state, self._members, self._worker)
        self._keys = keys
        self._subscriber = session.subscriber(f"{keys.change}/**", self._on_change)
        try:
            self._members.follow(self._on_member, timeout)
            self._join()
        except BaseException:
            self.close()
            raise
        self._worker.later(_COMPARE_EVERY, self._compare)

    def close(self) -> None:
        """Follow no more; again is no error."""
        self._subscriber.close()
        self._members.close()
        self._worker.close()
        self._state.watchers.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _join(self) -> None:
        if not self._members.zids:
            raise NoReplica(NOBODY)
        self._sync.join()

    def _on_member(self, member: Member, alive: bool) -> None:
        if not alive:
            self._sync.gone(member.zid)

    def _on_change(self, sample: Sample) -> None:
        payload, key = sample.payload, sample.key
        self._worker.offer(lambda: self._take(payload, key))  # else comparing finds it

    def _take(self, payload: bytes, key: str) -> None:
        try:
            self._state.take(payload, self._keys.reach(key, self._keys.change))
        except DecodeError as error:
            self._state.complaints.tell(NO_PARAMETER, error)

    def _compare(self) -> None:
        self._sync.compare_with_one()
        self._worker.later(_COMPARE_EVERY, self._compare)


NOBODY: Final = (
    "no process on this network holds the parameter store; start one that does, such as "
    "'rosz core', 'rosz launch …' or any node that uses parameters"
)
