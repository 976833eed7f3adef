"""The texts that bags have about a channel: QoS of its publishers, and definitions of events.

The QoS of a topic's publishers is written as by rosbag2 (``offered_qos_profiles``).
rosbag2 writes the values of policies as numbers, and since ROS 2 Jazzy as names. The numbers are
understood by every version.

ROS 2 names the types of the events of services ``pkg/srv/Name_Event``, and describes them by the
text of the service, ``request --- response``. Readers such as rosbags and mcap-ros2-support know
names as ``pkg/Name`` only, without underscores, and no text with ``---``. So bags have them as
messages that all readers know.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import msgspec

from rosz.names import short_type
from rosz.qos import FOREVER, QoS

_SECOND = 1_000_000_000
_NAME = re.compile(r"(\w+)/srv/(\w+)_Event")
_LONG_NAME = re.compile(r"\b\w+/(?:msg|srv)/\w+")
_PART_NAME = re.compile(r"\b(\w+/\w+)_(Request|Response)\b")
_RULE = "=" * 80
_FIRST_RULE = re.compile(r"^={3,}\s*$", re.MULTILINE)
_PARTS = re.compile(r"^---[ \t]*$", re.MULTILINE)
_INFO = "service_msgs/ServiceEventInfo"
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


@lru_cache(maxsize=32)  # each chunk repeats its channels
def parse_profiles(text: str) -> tuple[QoS, ...]:
    """Return the QoS of publishers from their text; unknown values have defaults.

    A bag whose QoS is damaged has its messages all the same, so nothing is raised.
    """
    import yaml

    try:
        rows = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
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
        if isinstance(policy, str) and policy in codes:
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


def event_type(type_name: str) -> str:
    """Return the name of a message type, ``pkg/msg/NameEvent``, for the type of an event.

    Args:
        type_name: Any type; the result is empty for one that is not of a service's events.
    """
    match = _NAME.fullmatch(type_name)
    return f"{match[1]}/msg/{match[2]}Event" if match else ""


def event_definition(type_name: str, text: str) -> str:
    """Return the definition of a service's events as a message's; other definitions unchanged."""
    match = _NAME.fullmatch(type_name)
    if match is None or not text:
        return text
    rule = _FIRST_RULE.search(text)
    end = rule.start() if rule else len(text)
    parts = _PARTS.split(text[:end], maxsplit=1)
    if len(parts) > 1:
        text = _as_message(f"{match[1]}/{match[2]}", parts, text[end:])
    text = _LONG_NAME.sub(lambda name: short_type(name[0]), text)
    return _PART_NAME.sub(r"\1\2", text)


def _as_message(service: str, parts: list[str], others: str) -> str:
    from rosz.msgs.service_msgs.msg import ServiceEventInfo  # few bags have events

    fields = [f"{_INFO} info"]
    texts = []
    for kind, body in zip(("Request", "Response"), parts, strict=True):
        fields.append(f"{service}{kind}[<=1] {kind.lower()}")
        texts.append(f"{_RULE}\nMSG: {service}{kind}\n{body.strip()}\n")
    has_time = "MSG: builtin_interfaces/Time\n" in others
    info = ServiceEventInfo._text if has_time else ServiceEventInfo._full_text
    texts.append(f"{_RULE}\nMSG: {_INFO}\n{info}")
    return "\n".join([*fields, *texts, others])
