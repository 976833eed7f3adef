"""What is measured, and how: everything in seconds, per second, percent or megabytes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from ..figures import OWN, Figure  # noqa: TID252  # tests is no package
from .processes import Lab

__all__ = ("MEASURES", "Measure")

_SECONDS = 1.0
_WATCHED_SECONDS = 4.0


class Measure(NamedTuple):
    """One thing to measure.

    Attributes:
        figure: Where it is taken down, for rosz and for those it is compared with.
        take: Measures it once for a system, by its name.
        rounds: How often at most: what takes long, or hardly varies, is measured less often.
    """

    figure: Figure
    take: Callable[[Lab, str], float]
    rounds: int = 100


def ping_pong(lab: Lab, system: str) -> float:
    with lab.ready(system, "echo"), lab.ready(system, "ping", "3000") as ping:
        return float(ping.read())


def flood(kind: str) -> Callable[[Lab, str], float]:
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
    waits = "at once" if system == OWN else "waits"
    with lab.ready(system, "listen") as listen:
        time.sleep(1)
        began = time.monotonic()
        with lab.peer(system, "first", waits) as peer:
            came = float(listen.read())
            peer.wait()
    return came - began


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


ROSPY = "rospy"
UNQUEUED = "rospy, queue_size=None"
ZENOH = "zenoh"
DIRECT = "zenoh, direct"
SHARED = "rosz, shared memory"

MEASURES = {
    "pingpong": Measure(
        Figure(
            "Twist there and back",
            "µs",
            {ROSPY: "at most 1", UNQUEUED: "", ZENOH: "at most 1.25", DIRECT: ""},
        ),
        ping_pong,
    ),
    "twist": Measure(
        Figure(
            "Twist into a callback",
            "per s",
            {ROSPY: "at least 2", UNQUEUED: "", ZENOH: "", DIRECT: ""},
        ),
        flood("Twist"),
    ),
    "image": Measure(
        Figure("1 MB Image into a callback", "per s", {ROSPY: "at least 1.2", UNQUEUED: ""}),
        flood("Image"),
    ),
    "shared": Measure(
        Figure("the same by shared memory", "per s", {ROSPY: "at least 4", UNQUEUED: ""}, SHARED),
        flood("Image"),
    ),
    "service": Measure(
        Figure("service call", "µs", {ROSPY: "at most 0.4", ZENOH: "at most 1.15", DIRECT: ""}),
        service_call,
    ),
    "start": Measure(Figure("process start to first message", "ms", {ROSPY: "at most 1"}), start),
    "timer": Measure(
        Figure("CPU of a 100 Hz timer publishing", "%", {ROSPY: "at most 1"}), timer_cpu, 3
    ),
    "idle": Measure(Figure("CPU of an idle node", "%", {ROSPY: "rosz under 0.5"}), idle_cpu, 2),
    "memory": Measure(Figure("memory of an idle node", "MB", {ROSPY: "at most 1"}), memory, 3),
}
