"""What happens in one history, drawn from a seed."""

from __future__ import annotations

import random
from typing import Literal, NamedTuple

__all__ = ("DURATION", "HOSTS", "Action", "History", "chain", "mesh")

HOSTS = "abc"
DURATION = 24.0
"""Seconds after which every link is healed and every process goes on."""
_SETTLED = 2.0
_STOPPED_SHARE = 0.6
"""Of the processes that something happens to; the others are killed."""

Verb = Literal["cut", "heal", "stop", "resume", "kill", "end", "start"]


def mesh(hosts: str) -> dict[str, str]:
    """Return the hosts that each one dials if all dial all."""
    return {host: hosts.replace(host, "") for host in hosts}


def chain(hosts: str) -> dict[str, str]:
    """Return the hosts that each one dials if those beside each other do."""
    beside = zip("-" + hosts, hosts, hosts[1:] + "-", strict=False)
    return {host: (before + after).strip("-") for before, host, after in beside}


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
    def of(cls, seed: int, hosts: str = HOSTS, *, ends: bool = False) -> History:
        """Return the history that a seed decides.

        Args:
            seed: The seed.
            hosts: Names of the hosts.
            ends: Whether nodes, one of them at least, are told to end, rather than stopped or
                killed.
        """
        draw = random.Random(seed)  # not for security
        later_dial_earlier = {host: hosts[:index] for index, host in enumerate(hosts)}
        neighbours = draw.choice([mesh(hosts), chain(hosts), later_dial_earlier])
        places = [(host, what) for host in hosts for what in ("link", "core", "node")]
        chosen = draw.sample(places, draw.randint(2, 4))
        if ends and not any(what == "node" for _, what in chosen):
            chosen[0] = draw.choice(hosts), "node"
        found: list[Action] = []
        verbs: tuple[Verb, Verb]
        for host, what in chosen:
            begin = draw.uniform(_SETTLED, DURATION / 2)
            if ends and what == "node":
                verbs, seconds = ("end", "start"), draw.uniform(0, 3)
            elif what == "link":
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
