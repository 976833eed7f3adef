"""The configuration, the current time and the effects of a step, shared by the parts of a core."""

from __future__ import annotations

import itertools
import logging
import random
from collections.abc import Sequence
from typing import Final

import msgspec

from rosz.errors import DecodeError
from rosz.params.paths import Path, joined
from rosz.params.replica.core.effects import Effect, Log, StartTimer
from rosz.params.replica.core.events import Moment, Timer
from rosz.params.wire import ReplicaMember

KEPT_TOMBSTONES: Final = 10_000
"""The newest deletions, which are never forgotten; twice as many are remembered at most."""


class Config(msgspec.Struct, frozen=True):
    """The configuration of a replica.

    Attributes:
        member: The replica itself, as others see it.
        scoped: Whether rules beside keys may keep some writes from some replicas.
        stored: Whether there is a file; a batch is then acknowledged when it is in it.
        listens: Whether it only listens: it has no token, and nobody waits for it.
        seed: Seed of the random decisions.
        keep: Number of the newest deletions that are never forgotten.
    """

    member: ReplicaMember
    scoped: bool = False
    stored: bool = False
    listens: bool = False
    seed: int = 0
    keep: int = KEPT_TOMBSTONES


def named(paths: Sequence[Path]) -> str:
    """Return the first of some paths, and how many more there are, as shown to users."""
    more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    return f"'{joined(paths[0])}'{more}"


def damage(what: str, error: DecodeError) -> Log:
    """Return the line to log for damaged bytes, once for each kind: senders may repeat it."""
    text = f"{what} (reported once): {error!s:.300}"
    return Log(logging.WARNING, text, f"{what} {error.type_name}")


class Work:
    """The context of a step: configuration, time, random numbers, and the effects so far.

    Args:
        config: Configuration of the replica.

    Attributes:
        config: The argument.
        zid: Session of the replica.
        random: Random numbers, for choices that may be arbitrary.
        now: Time of the step.
        effects: What is to be carried out after the step.
    """

    def __init__(self, config: Config) -> None:
        self.config: Config = config
        self.zid: str = config.member.zid
        self.random: random.Random = random.Random(config.seed)  # noqa: S311  # not for security
        self.now: Moment = Moment(0.0, 0)
        self.effects: list[Effect] = []
        self._numbers = itertools.count(1)

    def number(self) -> int:
        """Return a number that was not used before."""
        return next(self._numbers)

    def do(self, effect: Effect) -> None:
        """Add an effect."""
        self.effects.append(effect)

    def log(self, level: int, text: str, once: str = "") -> None:
        """Add a line to log; see `Log`."""
        self.effects.append(Log(level, text, once))

    def later(self, seconds: float, kind: str, number: int = 0, call: int = 0) -> None:
        """Start a timer; see `StartTimer`."""
        self.effects.append(StartTimer(Timer(kind, number), seconds, call))
