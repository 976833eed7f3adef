"""Specs: the content of definitions, independent of how their text is written; names of types."""

from __future__ import annotations

import keyword
from typing import Literal, TypeAlias

import msgspec

from rosz.message import SCALAR_CODES

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


ACTION_MESSAGES = ("Goal", "Result", "Feedback", "FeedbackMessage")
"""The messages that ROS 2 makes of an action, behind its name and ``_``."""

ACTION_SERVICES = ("SendGoal", "GetResult")
"""The services that ROS 2 makes of an action."""

SERVICE_MESSAGES = ("Request", "Response", "Event")
"""The messages that ROS 2 makes of a service, behind its name and ``_``."""


def attribute(name: str) -> str:
    """Return the attribute of a field or constant; a keyword of Python gets a ``_``."""
    return f"{name}_" if keyword.iskeyword(name) else name


def class_name(name: str) -> str:
    """Return the class name of a full type name: ``Twist``, ``SetBoolRequest``, ``SetBool``."""
    _, kind, base = name.split("/")  # those of actions are named as rclpy names them
    for part in ("Request", "Response"):
        if kind == "srv" and base.endswith(f"_{part}"):
            return base.removesuffix(f"_{part}") + part
    return attribute(base)


def action_of(base: str) -> str:
    """Return the action that a type in an ``action`` folder belongs to, both without packages.

    ``Fibonacci_Goal`` gives ``Fibonacci``, and so does ``Fibonacci``.
    """
    action, _, part = base.rpartition("_")
    return action if action and part in (*ACTION_MESSAGES, *ACTION_SERVICES) else base


def is_service(name: str) -> bool:
    """Return whether a full name is that of a service, such as one of the two of an action."""
    _, kind, base = name.split("/")
    part = base.removeprefix(f"{action_of(base)}_")
    return (kind == "srv" and not is_service_message(name)) or (
        kind == "action" and part in ACTION_SERVICES
    )


def is_service_message(name: str) -> bool:
    """Return whether a full name is that of a message that ROS 2 makes of a service."""
    _, kind, base = name.split("/")
    return kind == "srv" and base.rpartition("_")[2] in SERVICE_MESSAGES and "_" in base
