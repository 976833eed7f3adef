"""The hashes that ROS 1 (md5) and ROS 2 (RIHS01) identify a definition by.

ROS 1's is genmsg's: constants first, then fields, each on a line without comments and blanks; a
field that is a message stands as the hash of that message. ROS 2's spellings of types that are
built into ROS 1 count as ROS 1's: ``builtin_interfaces/Time`` as ``time``, and any
``std_msgs/Header`` as the one with ``seq``. So a text that means the same in both has the hash that
ROS 1 gives it. The few types that ROS 2 has changed have the hash of ROS 1's text.

ROS 2's (REP 2016) is SHA-256 over a JSON text that describes the fields of the type and of all
types in it; constants, defaults and comments are not part of it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from rosz.idl.catalog import Catalog
from rosz.idl.spec import (
    ACTION_MESSAGES,
    ACTION_SERVICES,
    ActionSpec,
    Field,
    FieldType,
    MessageSpec,
    ServiceSpec,
    is_service,
)

_BUILTIN = {"builtin_interfaces/msg/Time": "time", "builtin_interfaces/msg/Duration": "duration"}
_HEADER = "std_msgs/msg/Header"
_HEADER_MD5 = "2176decaecbce78abc3b96ef049fabed"

_MD5_IN_ROS1 = {
    "79e1dc841cdbf5f4ff851848b368746b": "4ddae7f048e32fda22cac764685e3974",  # BatteryState
    "b5aff04250fbf270b71bef9d82c2132e": "c9a58c1b0b154e0e6da7578cb991d214",  # CameraInfo
    "deed3b3500c4ca50f95eb656591164f6": "04a177815f75271039fa21f16acad8c9",  # DisparityImage
    "08c30e99c06dacc3ca640bd46225091f": "1de93c67ec8858b831025a08fbf1b35c",  # ImageMarker
    "b27df9b4124da18020f72c5b5eb24ae2": "4048c9de2a16f4ae8e0538085ebf1b97",  # Marker
    "23ac1cfdf2364e1754b785804f19f800": "331cdbddfa4bc96ffc3b9ad98900a54c",  # NavSatStatus
    "470cee326c156c680917c830889c04a6": "c005c34273dc426c67a020a87bc24148",  # Range
    "8c7314fcbb621a6a7a6af3200d726861": "d8f8cbc74c5ff283fca29569ccefb45d",  # SolidPrimitive
}
"""The hash of ROS 1's text by the hash of ROS 2's, of types that ROS 2 has changed: ROS 1's
peers identify the type by it."""


def message_md5(spec: MessageSpec, catalog: Catalog) -> str:
    """Return the md5 of a message, 32 hexadecimal digits."""
    if spec.name == _HEADER:
        return _HEADER_MD5
    md5 = _md5(_md5_text(spec, catalog))
    return _MD5_IN_ROS1.get(md5, md5)


def service_md5(spec: ServiceSpec, catalog: Catalog) -> str:
    """Return the md5 of a service, 32 hexadecimal digits."""
    text = _md5_text(spec.request, catalog) + _md5_text(spec.response, catalog)
    return _md5(text)


def _md5(text: str) -> str:
    import hashlib  # with OpenSSL, which few nodes need, since generated classes have their hashes

    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def _md5_text(spec: MessageSpec, catalog: Catalog) -> str:
    lines = [f"{constant.type} {constant.name}={constant.text}" for constant in spec.constants]
    lines += [f"{_md5_type(field.type, catalog)} {field.name}" for field in spec.fields]
    return "\n".join(lines).strip()


def _md5_type(kind: FieldType, catalog: Catalog) -> str:
    if kind.primitive:
        return kind.written + kind.suffix
    if kind.base in _BUILTIN:
        return _BUILTIN[kind.base] + kind.suffix
    return message_md5(catalog.message(kind.base), catalog)


_IDS = {
    "int8": 2,
    "uint8": 3,
    "char": 3,  # the .msg char is a uint8; ids 13 and 14 are IDL's
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
    "wstring": 18,
}
_MESSAGE = 1
_BOUNDED = 4  # added for a string with a bound
_SHAPES = {"one": 0, "fixed": 48, "bounded": 96, "sequence": 144}
_EMPTY = Field("structure_needs_at_least_one_member", FieldType("uint8"))
_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"


def message_hash(spec: MessageSpec, catalog: Catalog) -> str:
    """Return the type hash of a message, ``RIHS01_`` and 64 hexadecimal digits."""
    return _type_hash(spec, catalog.below(spec).values())


def service_hash(spec: ServiceSpec, catalog: Catalog) -> str:
    """Return the type hash of a service."""
    whole, below = service_parts(spec, catalog)
    return _type_hash(whole, below.values())


def action_hash(spec: ActionSpec, catalog: Catalog) -> str:
    """Return the type hash of an action."""
    whole, below = _action_parts(spec, catalog)
    return _type_hash(whole, below.values())


def identity(name: str, catalog: Catalog) -> tuple[str, str]:
    """Return the type hash and the md5 of a message or a service by its full name."""
    if is_service(name):
        service = catalog.service(name)
        return service_hash(service, catalog), service_md5(service, catalog)
    spec = catalog.message(name)
    return message_hash(spec, catalog), message_md5(spec, catalog)


def service_parts(
    spec: ServiceSpec, catalog: Catalog
) -> tuple[MessageSpec, dict[str, MessageSpec]]:
    """Return the type that a service is hashed as, and all types in it by name.

    That type holds the request, the response and the event.
    """
    event = MessageSpec(
        f"{spec.name}_Event",
        (
            Field("info", FieldType(_EVENT_INFO)),
            Field("request", FieldType(spec.request.name, shape="bounded", size=1)),
            Field("response", FieldType(spec.response.name, shape="bounded", size=1)),
        ),
    )
    info = catalog.message(_EVENT_INFO)
    below = {spec.request.name: spec.request, spec.response.name: spec.response, event.name: event}
    below[info.name] = info
    for part in (spec.request, spec.response, info):
        below |= catalog.below(part)
    whole = MessageSpec(
        spec.name,
        (
            Field("request_message", FieldType(spec.request.name)),
            Field("response_message", FieldType(spec.response.name)),
            Field("event_message", FieldType(event.name)),
        ),
    )
    return whole, below


def _action_parts(spec: ActionSpec, catalog: Catalog) -> tuple[MessageSpec, dict[str, MessageSpec]]:
    """Return the type that an action is hashed as, and all types in it by name."""
    goal, result, feedback, message = (f"{spec.name}_{part}" for part in ACTION_MESSAGES)
    send_goal, get_result = (f"{spec.name}_{part}" for part in ACTION_SERVICES)
    fields = {
        "goal": goal,
        "result": result,
        "feedback": feedback,
        "send_goal_service": send_goal,
        "get_result_service": get_result,
        "feedback_message": message,
    }
    below: dict[str, MessageSpec] = {}
    for name in (send_goal, get_result):
        whole, inner = service_parts(catalog.service(name), catalog)
        below |= {name: whole, **inner}
    for name in (goal, result, feedback, message):
        part = catalog.message(name)
        below |= {name: part, **catalog.below(part)}
    members = tuple(Field(name, FieldType(kind)) for name, kind in fields.items())
    return MessageSpec(spec.name, members), below


def describe(spec: MessageSpec) -> dict[str, Any]:
    """Return the description of one type, in ROS 2's order of keys."""
    return {
        "type_name": spec.name,
        "fields": [
            {"name": field.name, "type": _describe_type(field.type)}
            for field in spec.fields or (_EMPTY,)
        ],
    }


def describe_field(name: str, type_id: int, capacity: int, bound: int, nested: str) -> str:
    """Return the line of a definition for a field of a description; empty for one that stands in.

    Args:
        name: Name of the field.
        type_id: Number of its type (REP 2016).
        capacity: Number of elements, or the largest number.
        bound: Largest length of a bounded string.
        nested: Full name of its type if that is a message.

    Raises:
        ValueError: There is no type of that number in definitions of ROS.
    """
    if (name, type_id) == (_EMPTY.name, _IDS[_EMPTY.type.base]):
        return ""
    shapes = {0: "", 48: f"[{capacity}]", 96: f"[<={capacity}]", 144: "[]"}
    shape, base = divmod(type_id, 48)
    bases = {_MESSAGE: nested.replace("/msg/", "/")} | {
        number: text for text, number in _IDS.items() if text != "char"
    }
    bases |= {_IDS[text] + _BOUNDED: f"{text}<={bound}" for text in ("string", "wstring")}
    if base not in bases or 48 * shape not in shapes:
        raise ValueError(f"field '{name}' has a type of number {type_id}, which no definition has")
    return f"{bases[base]}{shapes[48 * shape]} {name}\n"


def _describe_type(kind: FieldType) -> dict[str, Any]:
    base = _IDS.get(kind.base, _MESSAGE) + (_BOUNDED if kind.bound else 0)
    return {
        "type_id": base + _SHAPES[kind.shape],
        "capacity": kind.size,
        "string_capacity": kind.bound,
        "nested_type_name": "" if kind.primitive else kind.base,
    }


def _type_hash(spec: MessageSpec, below: Iterable[MessageSpec]) -> str:
    text = json.dumps(
        {
            "type_description": describe(spec),
            "referenced_type_descriptions": [
                describe(other) for other in sorted(below, key=lambda other: other.name)
            ],
        }
    )
    import hashlib

    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()
