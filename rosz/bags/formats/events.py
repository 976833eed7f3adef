"""The types of the events of services, as messages that all readers of bags know.

ROS 2 names them ``pkg/srv/Name_Event`` and describes them by the text of the service, ``request ---
response``. Readers such as rosbags and mcap-ros2-support know names as ``pkg/Name`` only, without
underscores, and no text with ``---``.
"""

from __future__ import annotations

import re

from rosz.names import short_type

_NAME = re.compile(r"(\w+)/srv/(\w+)_Event")
_LONG_NAME = re.compile(r"\b\w+/(?:msg|srv)/\w+")
_PART_NAME = re.compile(r"\b(\w+/\w+)_(Request|Response)\b")
_RULE = "=" * 80
_FIRST_RULE = re.compile(r"^={3,}\s*$", re.MULTILINE)
_PARTS = re.compile(r"^---[ \t]*$", re.MULTILINE)
_INFO = "service_msgs/ServiceEventInfo"


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
