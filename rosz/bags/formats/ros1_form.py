"""Channels, definitions and payloads of ROS 2's form as those of ROS 1, and back.

Both forms of a message are its fields in their order. They differ in the layout of the bytes, in
the names of some types and fields, and in the sequence number, which ROS 1 has in the header.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from rosz.bags.bag import Channel, Payload
from rosz.bags.messages import class_of, described
from rosz.idl import parse_message
from rosz.message import Message, ros1_fields
from rosz.typestore import TypeStore

FromCdr = Callable[[Payload, int], bytes]
"""Function that returns ROS 1's bytes of a payload with its sequence number."""

_RULE = "=" * 80
_TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
_HEADER = "std_msgs/Header"
_HEADER_TEXT = "uint32 seq\ntime stamp\nstring frame_id\n"


def to_ros1(channel: Channel, types: TypeStore) -> tuple[Channel, FromCdr]:
    """Return a channel in ROS 1's form, and the function that translates its payloads.

    Raises:
        RoszError: The definition is damaged, or it is missing and the type is unknown.
    """
    if channel.encoding == "ros1":
        return channel, lambda data, _: bytes(data)
    cls = class_of(channel, types)
    form = msgspec.structs.replace(
        channel,
        encoding="ros1",
        definition=ros1_definition(cls),
        md5=cls._md5sum,
        type_hash="",
        language="",
    )
    if not cls._has_header:
        return form, lambda data, _: cls.from_cdr(data).to_ros1()

    def translate(data: Payload, sequence: int) -> bytes:
        message: Any = cls.from_cdr(data)
        message.header.seq = sequence & 0xFFFFFFFF
        encoded: bytes = message.to_ros1()
        return encoded

    return form, translate


def to_cdr(channel: Channel, types: TypeStore) -> tuple[Channel, Callable[[Payload], bytes]]:
    """Return a channel in ROS 2's form, and the function that translates its payloads.

    Raises:
        RoszError: As `to_ros1`.
    """
    if channel.encoding != "ros1":
        return channel, bytes
    cls = class_of(channel, types)
    form = msgspec.structs.replace(channel, encoding="cdr", language="", **described(cls))
    return form, lambda data: cls.from_ros1(data).to_cdr()


def ros1_definition(cls: type[Message]) -> str:
    """Return the definition of a type, and of the types in it, as ROS 1 writes it."""
    texts = [_text(cls)]
    texts += [f"{_RULE}\nMSG: {below._type}\n{_text(below)}" for below in _below(cls)]
    return "\n".join(texts)


def _text(cls: type[Message]) -> str:
    if cls._type == _HEADER:
        return _HEADER_TEXT
    spec = parse_message(cls._type_name, cls._text, f"<{cls._type_name}>")
    lines = [f"{constant.type} {constant.name}={constant.text}" for constant in spec.constants]
    old_names = {new: old for old, new in cls._ros1_names.items()}
    for slot in ros1_fields(cls):
        base = slot.kind if isinstance(slot.kind, str) else slot.kind._type
        shape = f"[{slot.size}]" if slot.shape == "fixed" else "[]" if slot.counted else ""
        lines.append(f"{_TIMES.get(base, base)}{shape} {old_names.get(slot.name, slot.name)}")
    return "".join(f"{line}\n" for line in lines)


def _below(cls: type[Message]) -> list[type[Message]]:
    """Return the types in a definition, each once, without those that ROS 1 has built in."""
    nested: dict[type[Any], None] = {}
    rest = _nested(cls)
    while rest:
        kind = rest.pop(0)
        if kind not in nested and kind._type not in _TIMES:
            nested[kind] = None
            rest[:0] = _nested(kind)
    return list(nested)


def _nested(cls: type[Message]) -> list[type[Any]]:
    return [slot.kind for slot in ros1_fields(cls) if isinstance(slot.kind, type)]
