"""The parameter store for those who are no replicas: they ask one.

Who only reads loads nothing of a replica, which takes longer than to ask.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

from rosz.errors import DecodeError, NoReplica, ParamError, ParamNotFound, WaitTimeout
from rosz.params.keys import Keys, Member
from rosz.params.merge import Change, condense, spread
from rosz.params.paths import joined, split
from rosz.params.values import Value, normalise
from rosz.params.wire import Answer, Batch, Question, decode, encode
from rosz.params.writes import DELETED
from rosz.session import Session, Stamp, clamp_timeout

if TYPE_CHECKING:
    from rosz.params.replica import Outcome
    from rosz.params.replica.follower import Follower

__all__ = ("ParamClient",)

_TOKENS_BY: Final = 2.0
_PATIENCE: Final = 1.0
"""Seconds after which the next replica is asked."""

_JOINING_POLL: Final = 0.02


class ParamClient:
    """Reads and writes parameters through the replicas of others.

    Args:
        session: The network; stays open.
        domain: The ROS domain.
        origin: Who writes, for people; this process when not given.
        timeout: Seconds for each call.

    Raises:
        UsageError: The timeout is no number.
    """

    def __init__(
        self, session: Session, domain: int = 0, *, origin: str = "", timeout: float = 5.0
    ) -> None:
        self._session = session
        self._domain = domain
        self._keys = Keys(domain, scoped=session.secured)
        self._origin = origin
        self._timeout = clamp_timeout(timeout)
        self._members: list[Member] = []
        self._silent: dict[str, Member] = {}

    def get(self, name: str) -> Value:
        """Return the value of a global name.

        Raises:
            ParamNotFound: It is not set.
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        return normalise(self._ask(Question("get", joined(split(name)))).value)

    def origin(self, name: str) -> str:
        """Return who set the value of a global name; the errors are those of `get`."""
        return self._ask(Question("get", joined(split(name)))).origin

    def has(self, name: str) -> bool:
        """Tell whether a global name is set.

        Raises:
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        try:
            self.get(name)
        except ParamNotFound:
            return False
        return True

    def names(self) -> list[str]:
        """Return the global names of all that is set and no dict, sorted.

        Raises:
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        return [str(name) for name in self._ask(Question("names")).value]

    def search(self, name: str, node: str = "/") -> str | None:
        """Search for a name from a node's own upwards; return the global name found.

        Raises:
            ParamError: The name is empty or private.
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        try:
            return str(self._ask(Question("search", name, node)).value)
        except ParamNotFound:
            return None

    def set(self, name: str, value: object) -> Outcome:
        """Set a global name; a dict replaces all that was below it.

        Raises:
            ParamError: The value is none, or the root is to be no dict.
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        return self.write([(split(name), normalise(value, name))])

    def merge(self, name: str, value: object) -> Outcome:
        """Set a global name as ROS 1's command line does: a dict leaf by leaf, as one change.

        Raises:
            ParamError: The value is none, or the root is to be no dict.
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        return self.write(condense(spread(name, normalise(value, name))))

    def delete(self, name: str) -> Outcome:
        """Delete a global name and all below it; the root is only emptied.

        Raises:
            ParamNotFound: It is not set.
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        path = split(name)
        if not path:
            return self.write([(path, {})])
        self._ask(Question("get", joined(path)))
        return self.write([(path, DELETED)])

    def write(self, changes: Iterable[Change]) -> Outcome:
        """Make a batch of changes, which every replica applies as one.

        Args:
            changes: Paths with values already normalised, or `DELETED`, as `condense` returns them.

        Raises:
            ParamError: A change has no meaning in the tree; nothing has changed then.
            NoReplica: Nobody holds the store.
            WaitTimeout: Those who hold it do not answer.
        """
        from rosz.params.replica import ACKNOWLEDGED_BY, Outcome, process_label

        batch = list(changes)
        if not batch:
            self._look()
            return Outcome(0)
        seen = self._ask(Question("stamp")).value
        if type(seen) is not int:
            raise DecodeError("answer about parameters", -1, f"{seen!r}, expected a stamp")
        self._session.clock.observe(Stamp(seen, ""))
        stamp = self._session.stamp()
        message = Batch.of((stamp.time, stamp.id), self._origin or process_label(), batch)
        patience = min(ACKNOWLEDGED_BY, self._timeout)
        answer = self._ask(Question("write", batch=message, timeout=patience), batch)
        return Outcome(stamp.time, tuple(answer.slow))

    def follow(self) -> Follower:
        """Return a copy of the store that stays up to date, for reading and watching; close it.

        Raises:
            NoReplica: Nobody holds the store.
        """
        from rosz.params.replica.follower import Follower

        return Follower(self._session, self._domain, _TOKENS_BY)

    @property
    def silent(self) -> list[str]:
        """What people call the replicas that were asked and did not answer in time."""
        return sorted(member.label for member in self._silent.values())

    def _look(self) -> list[Member]:
        tokens = self._session.live_tokens(self._keys.tokens, _TOKENS_BY)
        self._members = sorted(self._keys.member(token) for token in tokens)
        if not self._members:
            from rosz.params.replica.follower import NOBODY

            raise NoReplica(NOBODY)
        return self._members

    def _ask(self, question: Question, batch: Sequence[Change] = ()) -> Answer:
        """Ask the replicas one after the other, those last that were asked in vain before.

        Args:
            question: What to ask.
            batch: What it writes, if it does.
        """
        deadline = time.monotonic() + self._timeout
        data = encode(question)
        patience = question.timeout + _PATIENCE
        while True:
            stopped = self._session.out_of_reach()
            for member in sorted(
                self._members or self._look(),
                key=lambda one: (one.zid in stopped, one.zid in self._silent),
            ):
                answer = self._ask_one(self._key(member, batch), member, data, patience)
                if answer is not None and answer.status != "joining":
                    return _checked(question, answer)
                if time.monotonic() >= deadline:
                    who = ", ".join(self.silent) or "those there are have not joined yet"
                    if self._session.secured:
                        who += "; or the rules beside their keys do not allow it"
                    raise WaitTimeout("answer about parameters", self._timeout, f"asked: {who}")
            self._members = []
            time.sleep(_JOINING_POLL)

    def _key(self, member: Member, batch: Sequence[Change]) -> str:
        if not batch:
            return self._keys.ask(member.zid)
        return self._keys.reaching(self._keys.set(member.zid), (path for path, _ in batch))

    def _ask_one(self, key: str, member: Member, data: bytes, patience: float) -> Answer | None:
        replies = self._session.get(key, payload=data, timeout=patience)
        for reply in replies:
            if reply.ok:
                return decode(reply.payload, Answer)
        if replies:  # an error in place of an answer: the time is over; nothing at all: it is gone
            self._silent[member.zid] = member
        return None


def _checked(question: Question, answer: Answer) -> Answer:
    if answer.status == "missing":
        raise ParamNotFound(question.name, answer.value if isinstance(answer.value, list) else ())
    if answer.status != "ok":
        raise ParamError(answer.text)
    return answer
