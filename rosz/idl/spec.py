"""What a definition says, free of its text's form."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

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

PRIMITIVES = frozenset(
    {
        "bool",
        "byte",
        "char",
        "float32",
        "float64",
        "int8",
        "uint8",
        "int16",
        "uint16",
        "int32",
        "uint32",
        "int64",
        "uint64",
        "string",
        "wstring",
    }
)


class FieldType(msgspec.Struct, frozen=True):
    """Type of a field.

    Attributes:
        base: A primitive, or the full name of a message type (``geometry_msgs/msg/Point``).
        bound: Most units of a bounded string, 0 where there is no bound.
        shape: One value, a fixed array, a bounded or an unbounded sequence.
        size: Elements of a fixed array, most elements of a bounded sequence.
        written: The type as the text has it, without the array part.
    """

    base: str
    bound: int = 0
    shape: Shape = "one"
    size: int = 0
    written: str = ""

    @property
    def primitive(self) -> bool:
        """Whether it is made of primitives, not of messages."""
        return self.base in PRIMITIVES

    @property
    def counted(self) -> bool:
        """Whether the number of elements is on the wire."""
        return self.shape in ("bounded", "sequence")

    @property
    def suffix(self) -> str:
        """The array part as a definition spells it."""
        if self.shape == "one":
            return ""
        return {"fixed": f"[{self.size}]", "bounded": f"[<={self.size}]"}.get(self.shape, "[]")


def element_of(kind: FieldType) -> FieldType:
    """Return the type of one element of a sequence."""
    return FieldType(kind.base, kind.bound)


class Field(msgspec.Struct, frozen=True):
    """A field of a message.

    Attributes:
        name: Its name on the wire's side.
        type: Its type.
        default: Its default where the text gives one.
        line: Line of the text, 1-based.
        column: Column of the type in it, 1-based.
    """

    name: str
    type: FieldType
    default: Value | None = None
    line: int = 0
    column: int = 0


class Constant(msgspec.Struct, frozen=True):
    """A constant of a message.

    Attributes:
        name: Its name.
        type: A primitive.
        value: Its value.
        text: The value as the text has it, which ROS 1's hash is made of.
    """

    name: str
    type: str
    value: Scalar
    text: str


class MessageSpec(msgspec.Struct, frozen=True):
    """A message definition.

    Attributes:
        name: Full name, ``std_msgs/msg/String`` or ``std_srvs/srv/SetBool_Request``.
        fields: In the order of the wire.
        constants: In the order of the text.
        text: The definition.
        path: Where it was read.
    """

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()
    text: str = ""
    path: str = "<string>"


class ServiceSpec(msgspec.Struct, frozen=True):
    """A service definition: two messages, the text of both, and where it was read."""

    name: str
    request: MessageSpec
    response: MessageSpec
    text: str = ""
    path: str = "<string>"


class ActionSpec(msgspec.Struct, frozen=True):
    """An action definition: three messages, their text, and where it was read."""

    name: str
    goal: MessageSpec
    result: MessageSpec
    feedback: MessageSpec
    text: str = ""
    path: str = "<string>"
