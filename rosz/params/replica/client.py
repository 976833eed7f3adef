"""The parameter store for a process without a replica, which asks the replicas of others.

A command that only reads does not load the modules of a replica, because that takes longer than its
request.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Final

from rosz.errors import (
    DecodeError,
    NoReplica,
    ParamError,
    ParamNotFound,
    PartlyWritten,
    WaitTimeout,
)
from rosz.params.paths import joined, split
from rosz.params.values import Value, normalise
from rosz.params.wire import Batch, ClientReply, ClientRequest, Keys, ReplicaMember, decode, encode
from rosz.params.writes import DELETED, Change
from rosz.session import LONGEST_WAIT, Cancellation, Reply, Session, Stamp, clamp_timeout

if TYPE_CHECKING:
    from rosz.params.replica.core.effects import Outcome
    from rosz.params.replica.replica import Follower

_OnProgress = Callable[[int, list[str]], object]
_TOKENS_TIMEOUT: Final = 2.0
_REPLY_TIMEOUT: Final = 1.0
"""Seconds after which the next replica is asked."""

_LEAST_TIMEOUT: Final = 0.5
"""Least time in seconds that a write waits for all replicas, whatever it took to find one."""

_SLOWEST: Final = 1e6
"""Bytes of a batch that a replica reads in a second at least, before it reports progress."""

_JOINING_PAUSE: Final = 0.02


class ParamClient:
    """Reads and writes parameters through the replicas of others.

    Every call raises `NoReplica` if there is no replica, and `WaitTimeout` if none answers in time.

    Args:
        session: Session of the client; it stays open.
        domain: ROS domain.
        origin: Writer, as shown to users; this process by default.
        timeout: Time limit in seconds of each call.

    Raises:
        UsageError: The timeout is not a number.
    """

    def __init__(
        self, session: Session, domain: int = 0, *, origin: str = "", timeout: float = 5.0
    ) -> None:
        self._session = session
        self._domain = domain
        self._keys = Keys(domain, scoped=session.secured)
        self._origin = origin
        self._timeout = clamp_timeout(timeout)
        self._members: list[ReplicaMember] = []
        self._silent: dict[str, ReplicaMember] = {}
        self._answered = ""

    def get(self, name: str) -> Value:
        """Return the value of a global name.

        Raises:
            ParamNotFound: The parameter is not set.
        """
        return normalise(self._get(name).value)

    def names(self) -> list[str]:
        """Return the sorted global names of all parameters that are not dicts."""
        return [str(name) for name in self._request(ClientRequest("names")).value]

    def search(self, name: str, node: str = "/") -> str | None:
        """Search for a name from a node's own name upwards; return the global name found.

        Raises:
            ParamError: The name is empty or private.
        """
        try:
            return str(self._request(ClientRequest("search", name, node)).value)
        except ParamNotFound:
            return None

    def set(self, name: str, value: object) -> Outcome:
        """Set a global name; a dict replaces everything below it.

        Raises:
            ParamError: A parameter cannot hold the value, or the root would not be a dict.
            PartlyWritten: A replica refuses the write or cannot store it; it stands.
        """
        return self.write([(split(name), normalise(value, name))])

    def delete(self, name: str) -> Outcome:
        """Delete a global name and everything below it; the root is only emptied.

        Raises:
            ParamNotFound: The parameter is not set.
        """
        path = split(name)
        if not path:
            return self.write([(path, {})])
        self._get(name)
        return self.write([(path, DELETED)])

    def write(self, changes: Iterable[Change], on_progress: _OnProgress | None = None) -> Outcome:
        """Write a batch, which every replica applies as one change.

        The time limit counts from the last report of progress, so size alone does not exceed it.

        Args:
            changes: Paths with normalised values or `DELETED`, as `condense` returns them.
            on_progress: Function called now and then with the number of replicas that have the
                batch, and those that it waits for, as shown to users.

        Raises:
            ParamError: The tree cannot hold a change; nothing is changed then.
            PartlyWritten: A replica refuses the batch or cannot store it; it stands.
        """
        from rosz.params.replica.core.effects import Outcome
        from rosz.params.replica.replica import ACK_TIMEOUT, process_label

        batch = list(changes)
        if not batch:
            self._find_members()
            return Outcome(0)
        began = time.monotonic()
        seen = self._request(ClientRequest("stamp"), batch).value
        if type(seen) is not int:
            raise DecodeError("answer about parameters", -1, f"{seen!r}, expected a stamp")
        self._session.clock.observe(Stamp(seen, ""))
        stamp = self._session.stamp()
        message = Batch.of((stamp.time, stamp.id), self._origin or process_label(), batch)
        timeout = min(ACK_TIMEOUT, self._timeout) - (time.monotonic() - began)
        timeout = max(_LEAST_TIMEOUT, timeout)
        request = ClientRequest("write", batch=message, timeout=timeout, beats=True)
        reply = self._request(request, batch, on_progress)
        return Outcome(stamp.time, tuple(reply.slow), reply.holders + 1)

    def follow(self) -> Follower:
        """Return a copy of the store that stays up to date, for reading and watching.

        Close it after use.

        Raises:
            NoReplica: There is no replica.
        """
        from rosz.params.replica.replica import Follower

        return Follower(self._session, self._domain, _TOKENS_TIMEOUT)

    @property
    def silent(self) -> list[str]:
        """The replicas that were asked and did not answer in time, as shown to users."""
        return sorted(member.label for member in self._silent.values())

    def _get(self, name: str) -> ClientReply:
        return self._request(ClientRequest("get", joined(split(name))))

    def _find_members(self) -> list[ReplicaMember]:
        tokens = self._session.live_tokens(self._keys.tokens, _TOKENS_TIMEOUT)
        self._members = sorted(self._keys.member(token) for token in tokens)
        if not self._members:
            from rosz.params.replica.replica import NO_REPLICA

            raise NoReplica(NO_REPLICA)
        return self._members

    def _request(
        self,
        request: ClientRequest,
        batch: Sequence[Change] = (),
        on_progress: _OnProgress | None = None,
    ) -> ClientReply:
        """Ask the replicas one after the other, last those that did not answer before."""
        deadline = time.monotonic() + self._timeout
        payload = encode(request)
        silence = request.timeout + _REPLY_TIMEOUT
        while True:
            stopped = self._session.out_of_reach()
            for member in sorted(
                self._members or self._find_members(),
                key=lambda candidate: (
                    candidate.zid in stopped,
                    candidate.zid in self._silent,
                    candidate.zid != self._answered,
                ),
            ):
                key = self._keys.of(member.zid, "set" if batch else "ask")
                key = self._keys.scope(key, (path for path, _ in batch))
                reply = self._request_from(member, key, payload, silence, on_progress)
                if reply is not None and reply.status != "joining":
                    self._answered = member.zid
                    if reply.status == "missing":
                        beside = reply.value if isinstance(reply.value, list) else ()
                        raise ParamNotFound(request.name, beside)
                    if reply.reasons:
                        slow, reasons = reply.slow, reply.reasons
                        raise PartlyWritten(reply.what, reply.holders + 1, reasons, slow)
                    if reply.status != "ok":
                        raise ParamError(reply.text)
                    return reply
                if time.monotonic() >= deadline:
                    who = ", ".join(self.silent) or "those there are have not joined yet"
                    if self._session.secured:
                        who += "; or the rules beside their keys do not allow it"
                    raise WaitTimeout("answer about parameters", self._timeout, f"asked: {who}")
            self._members = []
            time.sleep(_JOINING_PAUSE)

    def _request_from(
        self,
        member: ReplicaMember,
        key: str,
        payload: bytes,
        silence: float,
        on_progress: _OnProgress | None,
    ) -> ClientReply | None:
        """Ask a replica; return its last reply, or ``None`` if it is gone or reports nothing."""
        replies: SimpleQueue[Reply | None] = SimpleQueue()
        cancellation = Cancellation()
        self._session.get_async(
            key,
            replies.put,
            lambda: replies.put(None),
            payload=payload,
            timeout=LONGEST_WAIT,
            cancel=cancellation,
        )
        limit = silence + len(payload) / _SLOWEST
        try:
            while (reply := replies.get(timeout=limit)) is not None and reply.ok:
                answer = decode(reply.payload, ClientReply)
                if answer.status != "working":
                    return answer
                if on_progress is not None:
                    on_progress(answer.holders + 1, answer.slow)
                limit = silence
            if reply is None:  # it is gone
                return None
        except Empty:
            pass
        finally:
            cancellation.cancel()
        self._silent[member.zid] = member
        return None
