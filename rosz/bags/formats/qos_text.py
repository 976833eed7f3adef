"""The QoS of a topic's publishers, as rosbag2 writes it into bags (``offered_qos_profiles``).

rosbag2 writes the values of policies as numbers, and since ROS 2 Jazzy as names. The numbers are
understood by every version.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import msgspec

from rosz.qos import FOREVER, QoS

_SECOND = 1_000_000_000
_POLICIES: dict[str, dict[str, int]] = {
    "history": {"keep_last": 1, "keep_all": 2},
    "reliability": {"reliable": 1, "best_effort": 2},
    "durability": {"transient_local": 1, "volatile": 2},
    "liveliness": {"automatic": 1, "manual_by_topic": 3},
}
_DURATIONS = {"deadline": "deadline", "lifespan": "lifespan", "lease": "liveliness_lease_duration"}


def format_profiles(profiles: Iterable[QoS], *, names: bool = False) -> str:
    """Return the text of the QoS of some publishers, with policies as names or as numbers."""
    import yaml  # slow to import, and most bags do without

    rows = profile_rows(profiles, names=names)
    return yaml.safe_dump(rows, sort_keys=False) if rows else ""


def profile_rows(profiles: Iterable[QoS], *, names: bool = False) -> list[dict[str, Any]]:
    """Return the QoS of some publishers as the rows of `format_profiles`."""
    rows = []
    for qos in profiles:
        given = msgspec.structs.asdict(qos)
        policies: dict[str, Any] = {
            name: given[name] if names else codes[given[name]] for name, codes in _POLICIES.items()
        }
        durations = {
            text: dict(zip(("sec", "nsec"), divmod(given[name], _SECOND), strict=True))
            for name, text in _DURATIONS.items()
        }
        row: dict[str, Any] = {"history": policies.pop("history"), "depth": qos.depth}
        row |= {name: policies[name] for name in ("reliability", "durability")}
        row |= {name: durations[name] for name in ("deadline", "lifespan")}
        row["liveliness"] = policies["liveliness"]
        row["liveliness_lease_duration"] = durations["liveliness_lease_duration"]
        row["avoid_ros_namespace_conventions"] = False
        rows.append(row)
    return rows


def parse_profiles(text: str) -> tuple[QoS, ...]:
    """Return the QoS of publishers from their text; unknown values have defaults.

    A bag whose QoS is damaged has its messages all the same, so nothing is raised.
    """
    import yaml

    try:
        rows = yaml.safe_load(text)
    except yaml.YAMLError:
        return ()
    if not isinstance(rows, list):
        return ()
    return tuple(_parse(row) for row in rows if isinstance(row, dict))


def _parse(row: dict[str, Any]) -> QoS:
    given: dict[str, Any] = {}
    for name, codes in _POLICIES.items():
        value = row.get(name)
        names = {code: policy for policy, code in codes.items()}
        policy = names.get(value) if isinstance(value, int) else value
        if policy in codes:
            given[name] = policy
    depth = row.get("depth")
    if isinstance(depth, int) and depth > 0:
        given["depth"] = depth
    for name, text in _DURATIONS.items():
        duration = row.get(text)
        if isinstance(duration, dict):
            seconds, rest = duration.get("sec"), duration.get("nsec")
            if isinstance(seconds, int) and isinstance(rest, int):
                total = seconds * _SECOND + rest
                given[name] = total if 0 < total < FOREVER else FOREVER
    return QoS(**given)
