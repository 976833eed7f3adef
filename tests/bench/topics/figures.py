"""What is measured, and how."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from .processes import Lab

__all__ = ("FIGURES", "Figure")

Measure = Callable[[Lab, str], float]
_SECONDS = 1.0
_WATCHED_SECONDS = 4.0


class Figure(NamedTuple):
    """One row of the table.

    Attributes:
        title: What it is, with its unit.
        measure: Measures it for a system, by its name.
        systems: Whom it is measured for: rosz first, then who it is compared with.
        aims: What the ratio to each of those is meant to be; ``>`` at least, ``<`` at most.
        digits: Printed behind the point.
    """

    title: str
    measure: Measure
    systems: tuple[str, ...]
    aims: tuple[str, ...]
    digits: int = 0


def ping_pong(lab: Lab, system: str) -> float:
    with lab.ready(system, "echo"), lab.ready(system, "ping", "3000") as ping:
        return float(ping.read())


def flood(kind: str) -> Measure:
    def measure(lab: Lab, system: str) -> float:
        with (
            lab.ready(system, "hear", kind, str(_SECONDS)) as hear,
            lab.ready(system, "pour", kind),
        ):
            return float(hear.read())

    return measure


def service_call(lab: Lab, system: str) -> float:
    with lab.ready(system, "serve"), lab.ready(system, "call", "600") as call:
        return float(call.read())


def start(lab: Lab, system: str) -> float:
    # rosz sends what is published before anybody is known; rospy loses it.
    waits = "at once" if system == "rosz" else "waits"
    with lab.ready(system, "listen") as listen:
        time.sleep(1)
        began = time.monotonic()
        with lab.peer(system, "first", waits) as peer:
            came = float(listen.read())
            peer.wait()
    return (came - began) * 1e3


def timer_cpu(lab: Lab, system: str) -> float:
    with lab.ready(system, "listen"), lab.ready(system, "tick") as peer:
        return _share(peer.ask)


def idle_cpu(lab: Lab, system: str) -> float:
    with lab.ready(system, "idle") as peer:
        return _share(peer.ask)


def memory(lab: Lab, system: str) -> float:
    with lab.ready(system, "idle") as peer:
        time.sleep(1)
        return float(peer.ask()[1])


def _share(ask: Callable[[], list[float]]) -> float:
    """Return the percentage of a core that is used."""
    time.sleep(1)
    before, began = ask()[0], time.monotonic()
    time.sleep(_WATCHED_SECONDS)
    return 100 * (ask()[0] - before) / (time.monotonic() - began)


_ALL = ("rosz", "rospy", "rospy, queue_size=None", "zenoh", "zenoh, direct")
_BOTH = ("rosz", "rospy")
_NODES = ("rosz", "rospy", "rospy, queue_size=None")
_SHARED = ("rosz, shared memory", "rospy", "rospy, queue_size=None")

FIGURES = {
    "pingpong": Figure("Twist there and back, µs", ping_pong, _ALL, ("< 1", "", "< 1.25", "")),
    "twist": Figure("Twist into a callback, per s", flood("Twist"), _ALL, ("> 2", "", "", "")),
    "image": Figure("1 MB Image into a callback, per s", flood("Image"), _NODES, ("> 1.2", "")),
    "shared": Figure("the same by shared memory", flood("Image"), _SHARED, ("> 4", "")),
    "service": Figure(
        "service call, µs",
        service_call,
        ("rosz", "rospy", "zenoh", "zenoh, direct"),
        ("< 0.4", "< 1.15", ""),
    ),
    "start": Figure("process start to first message, ms", start, _BOTH, ("< 1",)),
    "timer": Figure("CPU of a 100 Hz timer publishing, %", timer_cpu, _BOTH, ("< 1",), 2),
    "idle": Figure("CPU of an idle node, %", idle_cpu, _BOTH, ("",), 2),
    "memory": Figure("memory of an idle node, MB", memory, _BOTH, ("< 1",)),
}
