"""The effects of a step of a replica's core.

The caller of the core carries the effects out after the step, in their order.
"""

from __future__ import annotations

import msgspec

from rosz.params.paths import Path
from rosz.params.replica.core.events import Timer
from rosz.params.tree import Tree
from rosz.params.wire import Batch, SyncReply, SyncRequest
from rosz.params.writes import Write


class Outcome(msgspec.Struct, frozen=True):
    """The result of a write.

    Attributes:
        time: Time of the write, in nanoseconds since the epoch.
        slow: Replicas that did not acknowledge it in time, as shown to users.
        holders: Number of other replicas that acknowledged it in time.
        alone: Whether only this process has it, as far as it can see.
    """

    time: int
    slow: tuple[str, ...] = ()
    holders: int = 0
    alone: bool = False


class Effect(msgspec.Struct, frozen=True):
    """Something that a replica does; the base class of all effects."""


class Answer(Effect, frozen=True):
    """A call of the process returns.

    Attributes:
        call: Number of the call.
        result: What it returns, or the error that it raises.
    """

    call: int
    result: Outcome | bool | Exception


class TreeChanged(Effect, frozen=True):
    """The tree changed; readers must see the new one before the step's other effects are done.

    Attributes:
        old: Tree before.
        new: Tree after.
        writes: The writes that made the change, for watchers.
        own: Whether this process wrote them.
    """

    old: Tree
    new: Tree
    writes: list[Write]
    own: bool = False


class Publish(Effect, frozen=True):
    """Send a batch to all replicas that can be reached; it may get lost.

    Attributes:
        number: Number of the batch, to be given back in acknowledgements.
        batch: The batch.
        paths: Paths that it writes.
        patient: Whether to send it in the background, since the link to a receiver may be full.
    """

    number: int
    batch: Batch
    paths: list[Path]
    patient: bool = False


class Resend(Effect, frozen=True):
    """Send a batch to single replicas as a query; their replies are acknowledgements.

    Attributes:
        zids: Their sessions.
        number: Number of the batch.
        batch: The batch.
        paths: Paths that it writes.
        timeout: Time limit of the query in seconds.
    """

    zids: tuple[str, ...]
    number: int
    batch: Batch
    paths: list[Path]
    timeout: float


class Acknowledge(Effect, frozen=True):
    """Acknowledge a batch of another replica.

    Attributes:
        sender: Session of the writer.
        number: Number of the batch there.
        reason: Why it is not taken, or cannot be stored; empty if this replica has it.
        query: Number of the query to reply to; if 0, publish a message to the writer.
    """

    sender: str
    number: int
    reason: str = ""
    query: int = 0


class SendQuery(Effect, frozen=True):
    """Send a query to one replica; `QueryEnded` must follow, after the timeout at the latest.

    Attributes:
        number: Number of the query.
        zid: Session of the replica.
        request: The message.
        paths: Paths of the writes that it tells; empty if it is a comparison (``sync``).
        timeout: Time limit in seconds.
    """

    number: int
    zid: str
    request: SyncRequest
    paths: list[Path]
    timeout: float


class Reply(Effect, frozen=True):
    """Reply to a query of another replica.

    Attributes:
        query: Number of the query.
        reply: The reply, or the text of an error.
    """

    query: int
    reply: SyncReply | str


class StartTimer(Effect, frozen=True):
    """Start a timer, which fires once.

    Attributes:
        timer: The timer.
        seconds: Time until it fires.
        call: The call that it belongs to; 0 if none. A call has one timer at most; a new one takes
            its place, and the answer ends it.
    """

    timer: Timer
    seconds: float
    call: int = 0


class Save(Effect, frozen=True):
    """Add writes to the file; `Saved` must follow, in the order of the numbers.

    Attributes:
        number: Number of the save.
        writes: The writes; of one path, the newer one stays.
    """

    number: int
    writes: list[Write]


class Compact(Effect, frozen=True):
    """Replace the whole content of the file; `Saved` must follow, in the order of the numbers.

    Attributes:
        number: Number, of the same series as those of saves.
        writes: All writes.
        horizon: Horizon of their set.
    """

    number: int
    writes: list[Write]
    horizon: int


class DeclareToken(Effect, frozen=True):
    """Declare the liveliness token of this replica."""


class DeclareSeed(Effect, frozen=True):
    """Declare the token that marks this replica as a seed."""


class UndeclareSeed(Effect, frozen=True):
    """Undeclare the token that marks this replica as a seed."""


class FollowAll(Effect, frozen=True):
    """Report all replicas from now on, those that exist first.

    Attributes:
        watch: Number to give in the events; events with an older number are ignored.
    """

    watch: int


class UnfollowAll(Effect, frozen=True):
    """Report only seeds from now on."""


class SeedsChanged(Effect, frozen=True):
    """The seeds changed, or whether this replica is one: see `ReplicaCore.is_oldest_seed`."""


class Leave(Effect, frozen=True):
    """Tell all others that this replica leaves, then undeclare its tokens; follows `CloseCalled`.

    The others may not hear it.
    """


class FindStoppedPeers(Effect, frozen=True):
    """Find the sessions of this machine with stopped processes: `StoppedPeersFound` must follow."""


class ReadStorages(Effect, frozen=True):
    """Read what storages of other programs hold: `StoragesRead` must follow, within seconds."""


class Log(Effect, frozen=True):
    """Log a line.

    Attributes:
        level: Level of the logging module.
        text: The line.
        once: If not empty, the kind of line, of which only the first is logged.
    """

    level: int
    text: str
    once: str = ""
