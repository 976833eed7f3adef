"""Quality of service of publishers, subscriptions and services (REP 2003, rmw)."""

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
"""Number of nanoseconds that rmw uses for "no limit"."""


class QoS(msgspec.Struct, frozen=True):
    """The quality of service that an entity offers or requests.

    Attributes:
        depth: Number of newest samples kept.
        reliability: ``best_effort`` may drop samples on a lossy link.
        durability: ``transient_local`` keeps ``depth`` samples for late joiners.
        history: ``keep_all`` never drops samples, and makes a publisher wait instead.
        deadline: Nanoseconds between samples; for information only.
        lifespan: Nanoseconds that a sample is valid; for information only.
        liveliness: ``automatic`` or ``manual_by_topic``; for information only.
        lease: Nanoseconds; for information only.
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
        """Whether late joiners receive earlier samples."""
        return self.durability == "transient_local"


DEFAULT = QoS()
LATCHED = QoS(depth=1, durability="transient_local")
SENSOR_DATA = QoS(depth=5, reliability="best_effort")
SERVICES = QoS()
PARAMETERS = QoS(depth=1000)
CLOCK = QoS(depth=1, reliability="best_effort")
ROSOUT = QoS(depth=1000, durability="transient_local", lifespan=10_000_000_000)


def for_queue(size: int) -> QoS:
    """Return the QoS of a ROS 1 queue_size, where 0 means no limit.

    Raises:
        UsageError: The size is negative or not an integer.
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
