"""Messages of a bag as messages of the types that are known here.

A bag holds the definition that its messages were recorded by. Where the type known here is another
one, each field is taken from the field of its name. A field that the bag lacks has its default; one
that would be lost, or is of another type here, is a reason to refuse.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Any

import msgspec

from rosz.bags.bag import Channel, Payload
from rosz.bags.messages import class_of
from rosz.errors import DefinitionError, RoszError, TypeNotFound
from rosz.message import (
    ARRAY_CODES,
    INTEGER_RANGES,
    OCTETS,
    Message,
    Slot,
    compile_transcoder,
    slot_type,
    slots,
)
from rosz.typestore import TypeStore

_FLOATS = ("float32", "float64")


class MigrationError(DefinitionError):
    """A type in a bag whose fields do not fit those of the type known here."""


class Conversion(msgspec.Struct, frozen=True):
    """The conversion of a channel's messages to CDR of a type known here.

    Attributes:
        convert: Function that converts a payload, with its header; None if they are that already.
        added: Fields that get their defaults, since the bag lacks them.
    """

    message_type: type[Message]
    convert: Callable[[Payload], bytes] | None
    added: tuple[str, ...] = ()


def find_conversion(channel: Channel, types: TypeStore) -> Conversion:
    """Return how messages of a channel are converted; by the bag's type if it is not known here.

    Raises:
        MigrationError: Fields in the bag do not fit those of the type here.
        RoszError: The type is not known here, and its definition is missing or damaged.
    """
    try:
        local: type[Message] | None = types.message(channel.type)
    except RoszError:
        local = None
    if channel.encoding == "cdr":
        if channel.type_hash and (local is None or local._type_hash == channel.type_hash):
            return Conversion(local or _recorded(channel, types), None)
        recorded = class_of(channel, types)
        decode: Callable[[bytes], Message] = recorded.from_cdr
    elif channel.encoding == "ros1":
        recorded = class_of(channel, types)
        decode = recorded.from_ros1
    else:
        raise TypeNotFound(channel.type, f"its encoding is '{channel.encoding}', expected cdr")
    if local is not None and recorded is not local:
        migrate, added = find_migration(recorded, local)
        return Conversion(local, lambda data: migrate(decode(bytes(data))).to_cdr(), added)
    if channel.encoding == "cdr":
        return Conversion(recorded, None)
    pack = recorded._encode
    convert = compile_transcoder(recorded, lambda data: pack(decode(bytes(data))))
    return Conversion(recorded, convert)


def _recorded(channel: Channel, types: TypeStore) -> type[Message]:
    """Return the class of a type that is not known here; of its name and hash at least."""
    if channel.definition and not channel.language:
        recorded = class_of(channel, types)
        if recorded._type_hash == channel.type_hash:
            return recorded
    package, _, name = channel.type.split("/")
    names = {
        "_type": f"{package}/{name}",
        "_type_name": channel.type,
        "_type_hash": channel.type_hash,
    }
    made: type[Message] = type(name, (Message,), names)
    return made


def find_migration(
    old: type[Message], new: type[Message]
) -> tuple[Callable[[Any], Message], tuple[str, ...]]:
    """Return a function that makes messages of one class of those of another one.

    It comes with the paths of the fields that get their defaults.

    Raises:
        MigrationError: Fields do not fit.
    """
    finder = _Finder()
    migrate = finder.message(old, new, "")
    if finder.refused:
        raise MigrationError(
            f"the definition in the bag does not fit the one here: {'; '.join(finder.refused)}",
            f"<{new._type_name}>",
        )
    return migrate, tuple(finder.added)


class _Finder:
    """Compares two definitions field by field."""

    def __init__(self) -> None:
        self.refused: list[str] = []
        self.added: list[str] = []

    def message(self, old: type[Message], new: type[Message], path: str) -> Callable[[Any], Any]:
        if old is new or old._type_hash == new._type_hash:
            return lambda value: value
        theirs = {_modern(slot.name, new): slot for slot in slots(old)}
        steps: list[tuple[str, str, Callable[[Any], Any]]] = []
        for slot in slots(new):
            was = theirs.pop(_modern(slot.name, old), None) or theirs.pop(slot.name, None)
            if was is None:
                self.added.append(path + slot.name)
                continue
            convert = self.field(was, slot, path + slot.name)
            if convert is None:
                self.refused.append(
                    f"field '{path}{slot.name}' is a {slot_type(was)} in the bag,"
                    f" a {slot_type(slot)} here"
                )
            else:
                steps.append((was.name, slot.name, convert))
        self.refused += [
            f"field '{path}{lost.name}' is in the bag alone" for lost in theirs.values()
        ]

        def migrate(value: Any) -> Any:
            made = new()
            for source, target, convert in steps:
                setattr(made, target, convert(getattr(value, source)))
            return made

        return migrate

    def field(self, old: Slot, new: Slot, path: str) -> Callable[[Any], Any] | None:
        """Return the function that converts a field; None if its type does not fit."""
        if (old.shape == "one") != (new.shape == "one"):
            return None
        if new.shape in ("fixed", "bounded") and (old.shape, old.size) != (new.shape, new.size):
            return None
        if isinstance(old.kind, str) or isinstance(new.kind, str):
            fits = isinstance(old.kind, str) and isinstance(new.kind, str)
            return _primitive(old, new) if fits else None
        convert = self.message(old.kind, new.kind, f"{path}.")
        return convert if new.shape == "one" else lambda value: [convert(each) for each in value]


def _modern(name: str, cls: type[Message]) -> str:
    """Return the name here of a field that ROS 1 spells in another way."""
    return cls._ros1_names.get(name, name)


def _primitive(old: Slot, new: Slot) -> Callable[[Any], Any] | None:
    was, now = str(old.kind), str(new.kind)
    if new.bound and not 0 < old.bound <= new.bound:
        return None
    if was == now or (was in OCTETS and now in OCTETS):
        return lambda value: value
    wider = was in _FLOATS and now == "float64"
    if was in INTEGER_RANGES and now in INTEGER_RANGES:
        (low, high), (least, most) = INTEGER_RANGES[was], INTEGER_RANGES[now]
        wider = least <= low and high <= most
    if not wider:
        return None
    if new.shape == "one":
        return lambda value: value
    code = ARRAY_CODES.get(now)
    return (lambda value: array(code, list(value))) if code else bytes
