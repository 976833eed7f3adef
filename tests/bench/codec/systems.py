"""The libraries that are compared, each behind the same two functions."""

# mypy: disable-error-code="import-not-found"
from __future__ import annotations

import sys
from array import array
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, Protocol

from rosz.message import Message, slots
from rosz.typestore import TypeStore

Plain = dict[str, Any]
DEBIAN = "/usr/lib/python3/dist-packages"


class Codec(Protocol):
    """One type in one library."""

    @property
    def encode(self) -> Callable[[Any], Any]: ...
    @property
    def decode(self) -> Callable[[Any], Any]: ...
    def build(self, plain: Plain) -> Any: ...


class System(Protocol):
    """A library."""

    name: str

    def codec(self, type_name: str) -> Codec: ...


class RoszCodec:
    def __init__(
        self, cls: type[Message], encode: Callable[[Any], Any], decode: Callable[[Any], Any]
    ) -> None:
        self._cls = cls
        self.encode = encode
        self.decode = decode

    def build(self, plain: Plain) -> Any:
        return _build_rosz(self._cls, plain)


def _build_rosz(cls: type[Message], plain: Plain) -> Message:
    members: dict[str, Any] = {}
    for slot in slots(cls):
        member = plain[slot.name]
        if isinstance(slot.kind, type):
            nested: Any = slot.kind
            if slot.shape == "one":
                member = _build_rosz(nested, member)
            else:
                member = [_build_rosz(nested, one) for one in member]
        members[slot.name] = member
    return cls(**members)


class Rosz:
    name = "rosz"

    def __init__(self) -> None:
        self._store = TypeStore()

    def codec(self, type_name: str) -> Codec:
        cls = self._store.message(type_name)
        return RoszCodec(cls, cls._encode, cls._decode)


class RoszInRos1:
    """Rosz with ROS 1's byte layout."""

    name = "rosz, ROS 1"

    def __init__(self) -> None:
        self._store = TypeStore()

    def codec(self, type_name: str) -> Codec:
        cls = self._store.message(type_name)
        return RoszCodec(cls, cls._encode_ros1, cls._decode_ros1)


class GenpyCodec:
    def __init__(self, cls: Any) -> None:
        self._cls = cls

    def encode(self, message: Any) -> bytes:
        buffer = BytesIO()
        message.serialize(buffer)
        return buffer.getvalue()

    def decode(self, data: bytes) -> Any:
        return self._cls().deserialize(data)

    def build(self, plain: Plain) -> Any:
        return _build_genpy(self._cls, plain)


def _build_genpy(cls: Any, plain: Plain) -> Any:
    import genpy

    if issubclass(cls, genpy.TVal):
        return cls(plain["sec"], plain["nanosec"])
    message = cls()
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        if name == "seq":
            continue
        member = plain[name]
        base = kind.partition("[")[0]
        if isinstance(member, dict):
            member = _build_genpy(type(getattr(message, name)), member)
        elif isinstance(member, list) and member and isinstance(member[0], dict):
            member = [_build_genpy(_class_of(cls, base), one) for one in member]
        setattr(message, name, member)
    return message


def _class_of(owner: Any, type_name: str) -> Any:
    """Find a class beside the one that refers to it: dynamic ones are in no package."""
    module = sys.modules[owner.__module__]
    package, _, base = type_name.partition("/")
    for name in (f"_{package}__{base}", base):
        if hasattr(module, name):
            return getattr(module, name)
    import genpy.message

    return genpy.message.get_message_class(type_name)


class Genpy:
    name = "genpy"

    def __init__(self) -> None:
        if Path(DEBIAN).is_dir() and DEBIAN not in sys.path:
            sys.path.append(DEBIAN)
        import genpy.dynamic
        import genpy.message

        self._find = genpy.message.get_message_class
        self._compile = genpy.dynamic.generate_dynamic
        self._store = TypeStore()

    def codec(self, type_name: str) -> Codec:
        cls = self._find(type_name)
        if cls is None:  # Debian packages the definition only
            text = self._store.message(type_name)._full_text
            cls = self._compile(type_name, _as_ros1(text))[type_name]
        return GenpyCodec(cls)


def _as_ros1(full_text: str) -> str:
    """Spell a full text as ROS 1 does: time built in, headers with seq."""
    parts = full_text.split("=" * 80 + "\n")
    kept = [part for part in parts if not part.startswith("MSG: builtin_interfaces/")]
    text = ("=" * 80 + "\n").join(kept).replace("builtin_interfaces/Time", "time")
    bare = (line.partition("#")[0].split() for line in text.splitlines())
    lines = (" ".join(words if words[:1] == ["MSG:"] else words[:2]) for words in bare)
    return "\n".join(lines).replace("time stamp", "uint32 seq\ntime stamp")


class RosbagsCodec:
    def __init__(self, store: Any, type_name: str) -> None:
        self._store = store
        self._type = type_name

    def encode(self, message: Any) -> Any:
        return self._store.serialize_cdr(message, self._type)

    def decode(self, data: Any) -> Any:
        return self._store.deserialize_cdr(data, self._type)

    def build(self, plain: Plain) -> Any:
        return _build_rosbags(self._store, self._type, plain)


def _build_rosbags(store: Any, type_name: str, plain: Plain) -> Any:
    import numpy as np

    members = []
    for name, (_, details) in store.get_msgdef(type_name).fields:
        member = plain[name]
        if isinstance(member, dict):
            member = _build_rosbags(store, details, member)
        elif isinstance(member, list) and member and isinstance(member[0], dict):
            member = [_build_rosbags(store, details[0][1], one) for one in member]
        elif isinstance(member, array):
            member = np.array(member, member.typecode)
        elif isinstance(member, list) and member and isinstance(member[0], float):
            member = np.array(member, "f" if "float32" in str(details) else "d")
        elif isinstance(member, bytes):
            member = np.frombuffer(member, np.uint8)
        members.append(member)
    return store.types[type_name](*members)


class Rosbags:
    name = "rosbags"

    def __init__(self) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._store = get_typestore(Stores.ROS2_JAZZY)

    def codec(self, type_name: str) -> Codec:
        package, _, base = type_name.partition("/")
        return RosbagsCodec(self._store, f"{package}/msg/{base}")
