"""What the answers to calls promise."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import PartlyWritten
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.writes import Write

from .process import Call, Process, State
from .violation import fail

if TYPE_CHECKING:
    from .world import World

UNFOUND = "others that were not found in time"
RECOVERY = 9.5
"""Seconds in which absent replicas have to be waited for; the core takes 10."""
AN_ANSWER = 0.003
"""Seconds in which a process finds out which others are stopped."""


class Answers:
    """The checks of answers.

    Args:
        world: The world.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._checks: dict[type[said.Event], Callable[[Process, Call, Any], None]] = {
            said.WriteCalled: self._on_written,
            said.JoinCalled: self._on_joined,
            said.CompareCalled: self._on_compared,
            said.FollowCalled: self._on_followed,
            said.CloseCalled: self._on_closed,
        }

    def on_call(self, process: Process, call: Call) -> None:
        """Note what was so when a call began."""
        event, now = call.event, self.world.now
        if isinstance(event, said.WriteCalled) and not process.visible:
            call.awaited = {
                zid: lost + RECOVERY
                for zid, lost in process.lost.items()
                if zid not in process.left and now < lost + RECOVERY
            }
        if isinstance(event, (said.JoinCalled, said.CompareCalled)):
            others = self.world.others(process)
            whole = not (self.world.cuts or self.world.severed)
            if whole and all(other.state is State.RUNS for other in others):
                call.known = {other.zid: dict(other.held) for other in others if other.joined}

    def on_answer(self, process: Process, effect: done.Answer, effects: list[done.Effect]) -> None:
        call = process.calls.get(effect.call)
        if call is None:
            fail(self.world, process, f"answers a call that nobody made, or twice: {effect}")
        if self.world.now > call.deadline:
            fail(self.world, process, f"answers {call.event} too late")
        if isinstance(call.event, said.CloseCalled):
            call.known = {"": {}} if any(_tells_loss(effect) for effect in effects) else {}
        for line in effects:
            if isinstance(line, done.Log) and "is written, but not yet known to" in line.text:
                self._check_resent(process, call, line.text)
        self._checks[type(call.event)](process, call, effect.result)

    def _check_resent(self, process: Process, call: Call, line: str) -> None:
        """A batch must be sent once more before somebody counts as late."""
        event = call.event
        if not isinstance(event, said.WriteCalled) or event.timeout <= 0.3 or call.slept:
            return
        if self.world.closes(process):
            return
        if (
            not process.visible
            and self.world.now < max(process.lost.values(), default=0) + AN_ANSWER
        ):
            return  # those that are absent are waited for since the last one is lost
        resent = {self.world.processes[zid].label for zid in call.resent}
        late = (
            line.split("not yet known to ")[1].split(", which did not", maxsplit=1)[0].split(", ")
        )
        for label in late:
            if not label.endswith(" (stopped)") and _name(label) not in resent:
                fail(self.world, process, f"calls {label} late, and has not sent it {event} again")

    def _on_written(self, process: Process, call: Call, result: Any) -> None:
        event, writes = call.event, call.writes
        assert isinstance(event, said.WriteCalled)
        if isinstance(result, Exception) and not isinstance(result, PartlyWritten):
            if call.batch:
                fail(self.world, process, f"refuses what it sent: {result}")
            return
        if not call.batch or not process.applied(writes):
            fail(self.world, process, f"answers a write that it has not: {event}")
        if isinstance(result, done.Outcome):
            self._check_outcome(process, call, result)
        if event.timeout > 0:
            self._check_named_all(process, call, result)

    def _check_outcome(self, process: Process, call: Call, outcome: done.Outcome) -> None:
        if outcome.time != call.writes[0].time:
            fail(self.world, process, f"tells the time of another write: {outcome}")
        assert isinstance(call.event, said.WriteCalled)
        if call.event.timeout > 0:
            self._check_alone(process, outcome)
        elif outcome.holders:
            fail(self.world, process, f"has waited for nobody, and tells {outcome}")

    def _check_named_all(
        self, process: Process, call: Call, result: done.Outcome | PartlyWritten
    ) -> None:
        """Whoever lacks a write must be named."""
        writes = call.writes
        labels = [_name(label) for label in result.slow]
        lives = [other.label for other in self.world.processes.values()]
        if any(labels.count(label) > max(1, lives.count(label)) for label in labels):
            fail(self.world, process, f"names somebody twice: {result.slow}")
        reasons = result.reasons if isinstance(result, PartlyWritten) else {}
        named = {_name(label) for label in (*result.slow, *reasons)}
        self._check_holders(process, writes, result.holders)
        own = {process.label, f"the file of {process.label}"}
        if process.disk is not None and not process.has(writes) and not named & own:
            fail(self.world, process, f"tells nobody that its file lacks {writes}")
        if process.watching and UNFOUND not in result.slow:
            for zid in process.members:
                self._check_named(process, writes, zid, named, "is there")
        self._check_awaited(process, call, writes, named)

    def _check_holders(self, process: Process, writes: list[Write], holders: int) -> None:
        having = {
            other.zid
            for other in self.world.processes.values()
            if other is not process and self._is_holder(other, writes)
        }
        if len(having) < holders:
            fail(
                self.world, process, f"counts {holders} that have {writes}; there are {len(having)}"
            )

    def _is_holder(self, other: Process, writes: list[Write]) -> bool:
        """Tell whether another process may have acknowledged writes."""
        # What became of a disk after the end of a process says nothing about that.
        trusts_memory = other.state is State.ENDED or self.world.lies
        return other.applied(writes) if trusts_memory else other.has(writes)

    def _check_named(
        self, process: Process, writes: list[Write], zid: str, named: set[str], why: str
    ) -> None:
        other = self.world.processes[zid]
        if other.label not in named and not self._is_holder(other, writes):
            fail(
                self.world, process, f"does not name {zid}, which {why} and lacks {writes}: {named}"
            )

    def _check_awaited(
        self, process: Process, call: Call, writes: list[Write], named: set[str]
    ) -> None:
        now = self.world.now
        present = {self.world.processes[zid].label for zid in process.visible}
        awaited = {} if present else dict(call.awaited)
        if now < process.woke_at + RECOVERY:
            for zid, lost in process.lost.items():
                if process.woke_at <= lost < now < lost + RECOVERY:
                    awaited[zid] = lost + RECOVERY
        for zid, until in awaited.items():
            label = self.world.processes[zid].label
            absent = zid in process.lost and zid not in process.left and label not in present
            if absent and now < until:
                self._check_named(process, writes, zid, named, "has to be waited for")

    def _check_alone(self, process: Process, outcome: done.Outcome) -> None:
        if outcome.alone and (outcome.holders or (process.watching and process.members)):
            fail(self.world, process, f"is not alone: {outcome}")
        sure = process.watching and not process.members and UNFOUND not in outcome.slow
        if sure and not outcome.holders and not outcome.alone:
            fail(self.world, process, f"is alone, and does not say so: {outcome}")

    def _on_joined(self, process: Process, call: Call, result: Any) -> None:
        if not result or not process.core.ready:
            fail(self.world, process, f"joins with {result}")
        world = self.world
        if not world.lossless or world.cuts or world.severed or not call.known:
            return
        there = [world.processes[zid] for zid in call.known]
        if any(other.state is not State.RUNS or world.closes(other) for other in there):
            return
        if not any(process.applied(known.values()) for known in call.known.values()):
            fail(self.world, process, "has joined, and has not what any of the others had")

    def _on_compared(self, process: Process, call: Call, result: Any) -> None:
        if not result:
            return
        for zid, known in call.known.items():
            if zid in process.members and not process.applied(known.values()):
                fail(self.world, process, f"has compared with {zid}, and has not all that it had")

    def _on_followed(self, process: Process, call: Call, result: Any) -> None:
        if result and not process.watching:
            fail(self.world, process, f"does not know all, and answers {call.event}")

    def _on_closed(self, process: Process, call: Call, result: Any) -> None:
        if result is not True:
            fail(self.world, process, f"ends with {result}")
        if call.known:
            return
        own = [write for write in process.held.values() if write.clock == process.zid]
        others = [other for other in self.world.processes.values() if other is not process]
        # The store ends with the last process; one that only starts is not known yet.
        left = [other for other in others if other.zid in process.met]
        if all(other.state is State.ENDED or self.world.closes(other) for other in left):
            return
        for write in own:
            stored = process.disk is not None and (
                process.disk.holds(write)
                or any(write in effect.writes for effect in process.disk.pending)
            )
            if not stored and not any(other.applied([write]) for other in others):
                fail(self.world, process, f"ends, and takes {write} along without a word")


def _tells_loss(effect: done.Effect) -> bool:
    return isinstance(effect, done.Log) and "is lost with this process" in effect.text


def _name(label: str) -> str:
    return label.removesuffix(" (stopped)").removesuffix(" (link lost)")
