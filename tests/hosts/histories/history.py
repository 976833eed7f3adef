"""What happens in one history, drawn from a seed."""

from __future__ import annotations

import random
from typing import Literal, NamedTuple

__all__ = ("DURATION", "HOSTS", "Action", "History")

HOSTS = ("a", "b", "c")
MESH = {"a": "bc", "b": "ac", "c": "ab"}
CHAIN = {"a": "b", "b": "ac", "c": "b"}
"""The hosts that each one dials."""
DURATION = 24.0
"""Seconds after which every link is healed and every process goes on."""
_SETTLED = 2.0
_STOPPED_SHARE = 0.6
"""Of the processes that something happens to; the others are killed."""

Verb = Literal["cut", "heal", "stop", "resume", "kill", "start"]


class Action(NamedTuple):
    """One thing that happens.

    Attributes:
        time: Seconds since the beginning.
        verb: What happens.
        host: Where.
        what: The ``link``, the ``core`` or the ``node`` of the host.
    """

    time: float
    verb: Verb
    host: str
    what: str


class History(NamedTuple):
    """A topology, and what happens on it.

    Attributes:
        neighbours: The hosts that the core of each host dials.
        actions: What happens, in the order of the times. In the end nothing is cut or stopped.
    """

    neighbours: dict[str, str]
    actions: list[Action]

    @classmethod
    def of(cls, seed: int) -> History:
        """Return the history that a seed decides."""
        draw = random.Random(seed)  # not for security
        neighbours = draw.choice([MESH, CHAIN, {"a": "", "b": "a", "c": "ab"}])
        places = [(host, what) for host in HOSTS for what in ("link", "core", "node")]
        found: list[Action] = []
        verbs: tuple[Verb, Verb]
        for host, what in draw.sample(places, draw.randint(2, 4)):
            begin = draw.uniform(_SETTLED, DURATION / 2)
            if what == "link":
                verbs, seconds = ("cut", "heal"), draw.uniform(1, DURATION)
            elif draw.random() < _STOPPED_SHARE:
                verbs, seconds = ("stop", "resume"), draw.uniform(6, 14)
            else:
                verbs, seconds = ("kill", "start"), draw.uniform(0, 3)
            end = min(begin + seconds, DURATION)
            found += [Action(begin, verbs[0], host, what), Action(end, verbs[1], host, what)]
        return cls(neighbours, sorted(found))

    def __str__(self) -> str:
        dialled = " ".join(f"{host}>{other}" for host, other in self.neighbours.items() if other)
        steps = ", ".join(
            f"{action.time:.0f} {action.verb} {action.host}'s {action.what}"
            for action in self.actions
        )
        return f"{dialled}: {steps}"
