"""The events that a replica's core handles.

The caller of the core passes one event at a time to `ReplicaCore.step`, with the current time.
"""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from rosz.params.paths import ROOT, Path
from rosz.params.wire import Batch, ReplicaMember, SyncReply, SyncRequest
from rosz.params.writes import Change, Write


class Moment(NamedTuple):
    """The time of a step.

    Attributes:
        seconds: Time of a clock that never jumps and, if possible, counts the time in which the
            process or the machine stands still.
        wall: Time of the clock of the machine, in nanoseconds since the epoch. It may be wrong.
    """

    seconds: float
    wall: int


class Timer(msgspec.Struct, frozen=True):
    """A timer that an effect started.

    Attributes:
        kind: What it is for.
        number: Tells timers of one kind apart.
    """

    kind: str
    number: int = 0


class Event(msgspec.Struct, frozen=True):
    """Something that happens to a replica; the base class of all events."""


class Loaded(Event, frozen=True):
    """The stored writes are there; at most once, before all other events.

    Attributes:
        writes: The writes of the file, or those that the process left to itself when it restarted.
        horizon: Horizon of the set of writes.
        changed: Whether the file holds something else, and has to be written anew.
    """

    writes: list[Write]
    horizon: int = 0
    changed: bool = False


class JoinCalled(Event, frozen=True):
    """The replica is to join the others; once, when the seeds that exist have been reported.

    The call is answered with true when the replica has what the others have, or has to do without.
    """

    call: int


class WriteCalled(Event, frozen=True):
    """The process writes a batch; answered with an `Outcome`, or with the error to raise.

    Attributes:
        call: Number of the call; no two calls share one.
        changes: The batch, not empty; of two changes, the deeper one comes later.
        origin: Writer, as shown to users.
        stamp: Time and clock of the batch.
        given: Whether the stamp is the caller's own. If not, the core moves it behind all writes
            that it has seen.
        timeout: Time limit in seconds; 0 does not wait for others.
        by_progress: Whether the time counts from the last sign that the batch gets on, and not
            while the disk of this process is writing.
    """

    call: int
    changes: list[Change]
    origin: str
    stamp: tuple[int, str]
    given: bool = False
    timeout: float = 2.0
    by_progress: bool = False


class FollowCalled(Event, frozen=True):
    """The process wants to know all replicas from now on; answered with true once it does."""

    call: int
    timeout: float


class CompareCalled(Event, frozen=True):
    """The process compares with all others; answered with whether all of them replied in time."""

    call: int
    timeout: float


class CloseCalled(Event, frozen=True):
    """The process ends: answered with true, after writes that nobody else has were handed over.

    Attributes:
        call: Number of the call.
        timeout: Time limit in seconds.
    """

    call: int
    timeout: float = 1.0


class BatchReceived(Event, frozen=True):
    """A batch of another replica arrived, by publication or as a query to this replica alone.

    Attributes:
        sender: Session of the writer.
        number: Number of the batch there.
        batch: The batch.
        reach: Path that all writes must lie at or below.
        query: Number of the query that it came as, which the acknowledgement replies to; 0 if it
            was published.
        acknowledged: Whether it has been acknowledged already; see `ReplicaCore.may_defer`.
    """

    sender: str
    number: int
    batch: Batch
    reach: Path = ROOT
    query: int = 0
    acknowledged: bool = False


class Acknowledged(Event, frozen=True):
    """Another replica acknowledged a batch of this one, as a message or by a reply.

    Attributes:
        zid: Session of the other replica.
        number: Number of the batch.
        reason: Why it does not take or cannot store the batch; empty if it has it.
    """

    zid: str
    number: int
    reason: str = ""


class Progressed(Event, frozen=True):
    """A batch of this replica is being sent, or another replica is at work on it.

    Attributes:
        number: Number of the batch.
        zid: Session of the other replica; empty if the batch is being sent.
    """

    number: int
    zid: str = ""


class SyncReceived(Event, frozen=True):
    """Another replica compares itself with this one."""

    query: int
    request: SyncRequest


class WritesReceived(Event, frozen=True):
    """Another replica tells writes that this one lacks.

    Attributes:
        query: Number of the query.
        request: The message.
        reach: Path that all writes must lie at or below.
    """

    query: int
    request: SyncRequest
    reach: Path = ROOT


class QueryEnded(Event, frozen=True):
    """A query of this replica ended.

    Attributes:
        number: Number of the query.
        reply: The first reply; ``None`` if there was none, because the receiver is gone or rules
            forbid the query.
        failed: Whether an error came instead, such as the end of the time limit.
    """

    number: int
    reply: SyncReply | None
    failed: bool = False


class SeedCame(Event, frozen=True):
    """A token of a seed appeared."""

    member: ReplicaMember


class SeedWent(Event, frozen=True):
    """A token of a seed disappeared, because it was undeclared or because a link is lost."""

    zid: str


class MemberCame(Event, frozen=True):
    """A token of a replica appeared, while all are followed.

    Attributes:
        watch: Number of the `FollowAll`.
        member: The replica.
    """

    watch: int
    member: ReplicaMember


class MemberWent(Event, frozen=True):
    """A token of a replica disappeared, while all are followed: undeclared, or a link is lost."""

    watch: int
    zid: str


class MembersKnown(Event, frozen=True):
    """All tokens that existed when this replica began to follow all have been reported."""

    watch: int


class MemberLeft(Event, frozen=True):
    """Another replica said that it leaves; this may come before or after its token disappears.

    Attributes:
        zid: Its session.
        returns: Whether it restarts, and will be back with a new session and the same label.
    """

    zid: str
    returns: bool = False


class StoppedPeersFound(Event, frozen=True):
    """The answer to `FindStoppedPeers`: the sessions of this machine with stopped processes."""

    zids: frozenset[str]


class TimerFired(Event, frozen=True):
    """A timer fired, never before its time."""

    timer: Timer


class Saved(Event, frozen=True):
    """The disk is done with all saves and compactions up to a number.

    Attributes:
        number: Number of the last one of them.
        reason: Why they could not be saved, none of those since the last `Saved`; empty if all of
            them are on the disk.
    """

    number: int
    reason: str = ""


class StoragesRead(Event, frozen=True):
    """The answer to `ReadStorages`: the content of other programs' storages, as writes."""

    writes: list[Write]
