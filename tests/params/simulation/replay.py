"""A recorded real run in the simulation: the same events, in the order of their times."""

from __future__ import annotations

from typing import Any

from params.recording import RecordedStep, Recording, plain
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said

from .disk import FULL, Disk
from .process import Call, Process
from .world import Setting, World

_STALLED = 1.5
"""Seconds without a step after which a process has not run: the core has a timer each second."""


class _Replica(Process):
    """A replica of a recording; its clock shows the times that are recorded."""

    shows = 0

    def wall(self, _now: float) -> int:
        return self.shows


class Replay(World):
    """A world in which what is recorded happens again, and is checked.

    Args:
        recordings: The replicas that took part.
    """

    def __init__(self, recordings: list[Recording]) -> None:
        super().__init__(Setting(machines=0))
        self.lossless = False
        self._last: dict[str, float] = {}
        self._expected: list[Any] = []
        self._steps: list[tuple[float, str, RecordedStep]] = []
        for recording in recordings:
            config, member = recording.config, recording.config.member
            disk = Disk() if config.stored else None
            process = _Replica(member.label, 1, config, disk)
            self.processes[member.zid] = self.running[member.label] = process
            self._steps += [(step.now.seconds, member.zid, step) for step in recording.steps]

    def play(self) -> None:
        """Let everything happen; raise a `Violation` or an `AssertionError` if it differs."""
        for seconds, zid, step in sorted(self._steps, key=lambda entry: entry[0]):
            process = self.processes[zid]
            assert isinstance(process, _Replica)
            self.now, process.shows = seconds, step.now.wall
            if seconds - self._last.get(zid, seconds) > _STALLED:
                for call in process.calls.values():
                    call.slept = True
            self._last[zid] = seconds
            self._notice(process, step.event)
            self._expected = step.effects
            self.step(process, step.event)

    def end(self, zid: str) -> None:
        """Note that a process does not run any more."""
        del self.running[self.processes[zid].machine]

    def _notice(self, process: Process, event: said.Event) -> None:
        """Note what a process is told of others and what it is asked for."""
        before = process.visible.copy()
        match event:
            case said.SeedCame() | said.MemberCame():
                known = process.seeds if isinstance(event, said.SeedCame) else process.members
                known.add(event.member.zid)
                self._is_found(process, self.processes[event.member.zid])
            case said.SeedWent() | said.MemberWent():
                known = process.seeds if isinstance(event, said.SeedWent) else process.members
                known.discard(event.zid)
                if before != process.visible:
                    process.lost[event.zid] = self.now
            case said.MembersKnown():
                process.watching = event.watch == process.watch
            case said.MemberLeft(returns=False):
                process.left.add(event.zid)
            case said.WriteCalled() | said.JoinCalled() | said.FollowCalled() | said.CloseCalled():
                call = Call(event.call, event, float("inf"))
                process.calls[event.call] = call
                self.checks.answers.on_call(process, call)
            case said.Saved():
                assert process.disk is not None
                process.disk.full = bool(event.reason)
                done_ = [save for save in process.disk.pending if save.number <= event.number]
                assert process.disk.finish(len(done_)).reason == (FULL if event.reason else "")

    def _carry_out(self, process: Process, effect: done.Effect) -> None:
        match effect:
            case done.TreeChanged():
                process.show(effect)
            case done.Answer():
                process.calls.pop(effect.call)
            case done.FollowAll():
                process.watch, process.watching, process.members = effect.watch, False, set()
            case done.UnfollowAll():
                process.watch, process.watching, process.members = 0, False, set()
            case done.Save() | done.Compact():
                assert process.disk is not None
                process.disk.pending.append(effect)

    def step(self, process: Process, event: said.Event) -> None:
        """Make a step, compare its effects with those recorded, and check it."""
        self.steps += 1
        self.trace.append((self.now, process.zid, event))
        effects = process.core.step(event, said.Moment(self.now, process.wall(self.now)))
        assert plain(effects) == self._expected, f"{event} has other effects than in the real run"
        self.trace += [(self.now, process.zid, effect) for effect in effects]
        self.checks.on_step(process, event, effects)
        for effect in effects:
            self._carry_out(process, effect)
