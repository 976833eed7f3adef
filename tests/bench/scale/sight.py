"""What is measured of a crowd."""

from __future__ import annotations

import math

import msgspec

__all__ = ("STEPS", "Sight")

STEPS = ("python", "imports", "session", "declares", "discovery")
"""The steps of a start, from the process's beginning to the neighbour's first message."""


class Sight(msgspec.Struct):
    """What was measured of one crowd, not a number where it was not.

    Attributes:
        mode: Name of the topology.
        count: Nodes.
        complete: Seconds from the first start until everybody has heard its neighbour.
        busy: Seconds of a core that this takes for each node.
        core: Seconds of a core that the cores of rosz, or the router, take for it altogether.
        traffic: Kilobytes of discovery for each node over the links between the hosts, or over the
            loopback of the only one, until all is complete.
        memory: Megabytes for each node.
        idle: Percent of a core that is taken for each node when nothing happens.
        set_ms: Milliseconds of a set that all acknowledge.
        newcomer: Seconds from the start of one more node until it has heard its neighbour and all
            have heard it.
        death: Seconds from the kill of a node until the one that it heard knows.
        death_cpu: Milliseconds of a core that this takes for each other node.
        steps: Milliseconds of a core that each step of the start takes for a process, medians.
        trouble: Why there is no more.
        late: Whether that is because it took too long.
    """

    mode: str
    count: int
    complete: float = math.nan
    busy: float = math.nan
    core: float = math.nan
    traffic: float = math.nan
    memory: float = math.nan
    idle: float = math.nan
    set_ms: float = math.nan
    newcomer: float = math.nan
    death: float = math.nan
    death_cpu: float = math.nan
    steps: dict[str, float] = {}
    trouble: str = ""
    late: bool = False
