"""Specs: the content of definitions, independent of how their text is written."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from rosz.message import SCALAR_CODES

__all__ = (
    "PRIMITIVES",
    "ActionSpec",
    "Constant",
    "Field",
    "FieldType",
    "MessageSpec",
    "Scalar",
    "ServiceSpec",
    "Shape",
    "Value",
    "element_of",
)

Shape: TypeAlias = Literal["one", "fixed", "bounded", "sequence"]
Scalar: TypeAlias = bool | int | float | str
Value: TypeAlias = Scalar | tuple[Scalar, ...]

PRIMITIVES = frozenset({*SCALAR_CODES, "string", "wstring"})
"""Names of the primitive types."""


class FieldType(msgspec.Struct, frozen=True):
    """Type of a field.

    Attributes:
        base: Primitive type, or full name of a message type (``geometry_msgs/msg/Point``).
        bound: Largest length of a bounded string; 0 for no bound.
        shape: One value, a fixed array, a bounded or an unbounded sequence.
        size: Number of elements of a fixed array; largest number of a bounded sequence.
        written: The type as the text spells it, without the array part.
    """

    base: str
    bound: int = 0
    shape: Shape = "one"
    size: int = 0
    written: str = ""

    @property
    def primitive(self) -> bool:
        """Whether the base is a primitive type, not a message type."""
        return self.base in PRIMITIVES

    @property
    def counted(self) -> bool:
        """Whether the number of elements is on the wire."""
        return self.shape in ("bounded", "sequence")

    @property
    def suffix(self) -> str:
        """The array part as a definition spells it, such as ``[3]``."""
        if self.shape == "one":
            return ""
        return {"fixed": f"[{self.size}]", "bounded": f"[<={self.size}]"}.get(self.shape, "[]")


def element_of(kind: FieldType) -> FieldType:
    """Return the type of one element of a sequence."""
    return FieldType(kind.base, kind.bound)


class Field(msgspec.Struct, frozen=True):
    """A field of a message.

    Attributes:
        name: Name of the field.
        type: Type of the field.
        default: Default value, if the text has one.
        line: Line of the text, from 1.
        column: Column of the type in that line, from 1.
    """

    name: str
    type: FieldType
    default: Value | None = None
    line: int = 0
    column: int = 0


class Constant(msgspec.Struct, frozen=True):
    """A constant of a message.

    Attributes:
        name: Name of the constant.
        type: Primitive type.
        value: Value.
        text: The value as the text spells it, which ROS 1 hashes.
    """

    name: str
    type: str
    value: Scalar
    text: str


class MessageSpec(msgspec.Struct, frozen=True):
    """A message definition.

    Attributes:
        name: Full name, ``std_msgs/msg/String`` or ``std_srvs/srv/SetBool_Request``.
        fields: Fields in the order of the text, which is that of the wire.
        constants: Constants in the order of the text.
        text: Text of the definition.
        path: Path that it was read from.
    """

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()
    text: str = ""
    path: str = "<string>"


class ServiceSpec(msgspec.Struct, frozen=True):
    """A service definition: its two messages, their text, and the path it was read from."""

    name: str
    request: MessageSpec
    response: MessageSpec
    text: str = ""
    path: str = "<string>"


class ActionSpec(msgspec.Struct, frozen=True):
    """An action definition: its three messages, their text, and the path it was read from."""

    name: str
    goal: MessageSpec
    result: MessageSpec
    feedback: MessageSpec
    text: str = ""
    path: str = "<string>"
