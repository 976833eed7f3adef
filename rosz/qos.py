"""Quality of service of a topic or service endpoint, in ROS 2's terms (REP 2003, rmw)."""

from __future__ import annotations

import operator
from typing import Literal

import msgspec

from rosz.errors import UsageError

__all__ = (
    "CLOCK",
    "DEFAULT",
    "FOREVER",
    "LATCHED",
    "PARAMETERS",
    "ROSOUT",
    "SENSOR_DATA",
    "SERVICES",
    "QoS",
    "for_queue",
)

FOREVER = 9223372036_854775807
"""Nanoseconds that rmw takes for "no limit"."""


class QoS(msgspec.Struct, frozen=True):
    """What an endpoint promises or asks for.

    Attributes:
        depth: Samples kept, newest first.
        reliability: ``best_effort`` may drop on a lossy link.
        durability: ``transient_local`` keeps ``depth`` samples for late joiners.
        history: ``keep_all`` never drops and makes a publisher wait instead.
        deadline: Nanoseconds between samples; information only.
        lifespan: Nanoseconds for which a sample is of use; information only.
        liveliness: ``automatic`` or ``manual_by_topic``; information only.
        lease: Nanoseconds; information only.
    """

    depth: int = 10
    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"
    history: Literal["keep_last", "keep_all"] = "keep_last"
    deadline: int = FOREVER
    lifespan: int = FOREVER
    liveliness: Literal["automatic", "manual_by_topic"] = "automatic"
    lease: int = FOREVER

    @property
    def reliable(self) -> bool:
        """Whether delivery is reliable."""
        return self.reliability == "reliable"

    @property
    def latched(self) -> bool:
        """Whether late joiners get what was published before."""
        return self.durability == "transient_local"


DEFAULT = QoS()
LATCHED = QoS(depth=1, durability="transient_local")
SENSOR_DATA = QoS(depth=5, reliability="best_effort")
SERVICES = QoS()
PARAMETERS = QoS(depth=1000)
CLOCK = QoS(depth=1, reliability="best_effort")
ROSOUT = QoS(depth=1000, durability="transient_local", lifespan=10_000_000_000)


def for_queue(size: int) -> QoS:
    """Return the QoS for a queue of ROS 1, of so many samples; 0 means no limit there.

    Raises:
        UsageError: No queue has that size.
    """
    try:
        size = operator.index(size)
    except TypeError:
        raise UsageError(f"queue_size is {size!r}: expected an int, 0 for no limit") from None
    if size < 0:
        raise UsageError(f"queue_size is {size}: expected 1 or more, or 0 for no limit")
    if size == DEFAULT.depth:
        return DEFAULT
    return QoS(depth=size) if size else QoS(history="keep_all")
