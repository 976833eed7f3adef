"""A conversation with the core of one replica: events in, effects out."""

from __future__ import annotations

from typing import Any, TypeVar

from rosz.params.replica.core import Config, ReplicaCore
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.wire import Batch, ReplicaMember, SyncReply, SyncRequest
from rosz.params.writes import DELETED, Change

T = TypeVar("T", bound=done.Effect)
WALL = 1_795_000_000 * 10**9
ME = ReplicaMember(50, "aa", "me")
JOIN = 1_000_000


def member(zid: str, start: int = 10) -> ReplicaMember:
    return ReplicaMember(start, zid, f"process {zid}")


def change(name: str, value: Any = DELETED) -> Change:
    return tuple(name.split("/")), value


def batch(name: str, value: Any, time: int, clock: str = "bb") -> Batch:
    return Batch.of((time, clock), f"process {clock}", [change(name, value)])


class Dialogue:
    """The core of a replica, what it did in the last step, and its clock and timers."""

    def __init__(self, **config: Any) -> None:
        self.core = ReplicaCore(Config(ME, **config))
        self.seconds = 100.0
        self.skew = 0
        self.done: list[done.Effect] = []
        self.timers: list[tuple[float, said.Timer]] = []
        self._calls = 0

    def say(self, *events: said.Event) -> list[done.Effect]:
        """Hand events over; return the effects."""
        self.done = []
        for event in events:
            wall = WALL + int(self.seconds * 1e9) + self.skew
            self.done += self.core.step(event, said.Moment(self.seconds, wall))
        for effect in self.all(done.StartTimer):
            self.timers.append((self.seconds + effect.seconds, effect.timer))
        return self.done

    def all(self, kind: type[T]) -> list[T]:
        """Return what was done of one kind."""
        return [effect for effect in self.done if isinstance(effect, kind)]

    def only(self, kind: type[T]) -> T:
        """Return the one thing of a kind that was done."""
        (effect,) = self.all(kind)
        return effect

    def sleep(self, seconds: float) -> list[done.Effect]:
        """Let time pass, with all timers; return the effects."""
        until = self.seconds + seconds
        everything: list[done.Effect] = []
        while due := sorted(
            (entry for entry in self.timers if entry[0] <= until), key=lambda entry: entry[0]
        )[:1]:
            self.timers.remove(due[0])
            self.seconds = max(self.seconds, due[0][0])
            everything += self.say(said.TimerFired(due[0][1]))
        self.seconds = until
        self.done = everything
        return everything

    def stand_still(self, seconds: float) -> None:
        """Let time pass in which the process does nothing."""
        self.seconds += seconds

    def call(self) -> int:
        self._calls += 1
        return self._calls

    def join(self, *others: ReplicaMember) -> None:
        """Join, with others that have nothing and are all seeds."""
        self.say(*(said.SeedCame(other) for other in others), said.JoinCalled(JOIN))
        if not others:
            self.say(said.MembersKnown(self.only(done.FollowAll).watch))
            self.say(said.StoragesRead([]))
        else:
            while queries := self.all(done.SendQuery):
                self.say(said.QueryEnded(queries[0].number, SyncReply()))
        assert self.only(done.Answer) == done.Answer(JOIN, True)
        assert self.core.ready

    def write(self, name: str = "a", value: Any = 1, timeout: float = 2.0, **more: Any) -> int:
        """Write one parameter; return the number of the call."""
        call = self.call()
        stamp = WALL + int(self.seconds * 1e9) + self.skew, "aa"
        self.say(
            said.WriteCalled(call, [change(name, value)], "me", stamp, timeout=timeout, **more)
        )
        return call

    def know(self, *others: ReplicaMember) -> None:
        """Report all others to one that follows all."""
        watch = self.only(done.FollowAll).watch
        self.say(*(said.MemberCame(watch, other) for other in others), said.MembersKnown(watch))

    @property
    def answer(self) -> Any:
        return self.only(done.Answer).result


def writer(*others: ReplicaMember, **config: Any) -> tuple[Dialogue, int]:
    """Return one that knows all others and has written once, and the number of its watch."""
    talk = Dialogue(**config)
    talk.join(*others)
    talk.write("first", 0)
    if not others:
        return talk, 1
    watch = talk.only(done.FollowAll).watch
    publish = talk.only(done.Publish)
    talk.know(*others)
    talk.say(*(said.Acknowledged(other.zid, publish.number) for other in others))
    assert talk.answer.holders == len(others)
    return talk, watch


def requests(talk: Dialogue) -> list[tuple[str, SyncRequest]]:
    return [(query.zid, query.request) for query in talk.all(done.SendQuery)]
