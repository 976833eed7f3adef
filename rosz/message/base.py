"""Base classes of messages, services and actions, and the schema that describes fields.

A generated class holds only what differs from type to type: fields, constants, names, hashes, its
definition, and its codec as straight-line code. The rest is derived here from the class's schema
when it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import (
    Any,
    ClassVar,
    Generic,
    Protocol,
    Self,
    SupportsIndex,
    TypeAlias,
    TypeVar,
    overload,
)

import msgspec

from rosz.message.schema import SEQ, Schema, Slot, rclpy_type, slot_type, slots

_T = TypeVar("_T")

_RULE = "=" * 80


class Array(Protocol[_T]):
    """A numeric sequence: a list, an ``array.array`` or a numpy array."""

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[_T]: ...
    @overload
    def __getitem__(self, index: SupportsIndex, /) -> _T: ...
    @overload
    def __getitem__(self, index: slice, /) -> Array[_T]: ...
    def __setitem__(self, index: SupportsIndex, value: _T, /) -> None: ...


Bytes: TypeAlias = bytes | bytearray | memoryview | Array[int]
"""A sequence of octets; decoding gives ``bytes``."""


class Writable(Protocol):
    """A stream that :meth:`Message.serialize` writes to."""

    def write(self, data: bytes, /) -> object:
        """Write bytes."""


class _Derived(Generic[_T]):
    """A class attribute that is computed from the class at each access."""

    def __init__(self, compute: Callable[[type[Any]], _T]) -> None:
        self._compute = compute

    def __get__(self, instance: object, owner: type[Any]) -> _T:
        return self._compute(owner)


class _Ros1Codec:
    """A function of ROS 1's codec, compiled for a class when it is asked for first."""

    def __init__(self, maker: str) -> None:
        self._maker = maker

    def __set_name__(self, owner: type[Any], name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type[Any]) -> Callable[[Any], Any]:
        from rosz.message import ros1_codec

        described = next(cls for cls in owner.__mro__ if "_schema" in vars(cls))
        made: Callable[[Any], Any] = getattr(ros1_codec, self._maker)(described)
        if described is not Message:  # its subclasses would inherit it
            setattr(described, self._name, staticmethod(made))
        return made


def _slot_types(cls: type[Message]) -> list[str]:
    types = [slot_type(slot) for slot in slots(cls)]
    return ["uint32", *types] if issubclass(cls, Sequenced) else types


def _has_header(cls: type[Message]) -> bool:
    first = cls._schema[:1]
    if not first or first[0][0] != "header" or not isinstance(first[0][1], type):
        return False
    return issubclass(first[0][1], Sequenced)


def _full_text(cls: type[Message | Service]) -> str:
    parts = [cls._text]
    parts += (f"{_RULE}\nMSG: {below._type}\n{below._text}" for below in _below(cls))
    return "\n".join(parts)


def _below(cls: type[Message | Service]) -> list[type[Message]]:
    """Return the message types in a definition, each once, in genmsg's order."""
    tops = (cls.Request, cls.Response) if issubclass(cls, Service) else (cls,)
    classes: dict[type[Message], None] = {}
    rest = [kind for top in tops for _, kind, _ in top._schema if isinstance(kind, type)]
    while rest:
        kind = rest.pop(0)
        if kind not in classes:
            classes[kind] = None
            rest[:0] = [below for _, below, _ in kind._schema if isinstance(below, type)]
    return list(classes)


class _TakesRos1Names(msgspec.StructMeta):
    def __call__(cls, *args: Any, **members: Any) -> Any:  # noqa: N805  # a class is the instance
        """Make a message; members may have their names in ROS 1."""
        return super().__call__(*args, **_renamed(cls, members))


def _renamed(cls: Any, members: dict[str, Any]) -> dict[str, Any]:
    """Return members by the names that they have here."""
    renamed: dict[str, str] = cls._ros1_names
    if renamed.keys().isdisjoint(members):
        return members
    for old in renamed.keys() & members.keys():
        if renamed[old] in members:
            raise TypeError(f"'{old}' and '{renamed[old]}' are the same field: give one")
    return {renamed.get(name, name): value for name, value in members.items()}


class Derived(_TakesRos1Names):
    """Metaclass of classes that programs derive from messages, as from any class.

    They may have attributes of their own, and an ``__init__`` that calls that of its base. msgspec
    refuses both. It is not the metaclass of messages, which take a fifth longer to make with one.
    """

    def __new__(
        mcls, name: str, bases: tuple[type, ...], members: dict[str, Any], **options: Any
    ) -> Any:
        """Make a class."""
        initialize = members.pop("__init__", None)
        members = {"__reduce__": _reduce, "__copy__": _copy, **members}
        made = super().__new__(mcls, name, bases, members, **{"dict": True, "gc": True, **options})
        if initialize is not None:  # msgspec refuses it among the members
            setattr(made, "__init__", initialize)  # noqa: B010  # mypy refuses an assignment
        return made

    def __call__(cls, *args: Any, **members: Any) -> Any:  # a class is the instance
        """Make a message with default values, and initialize it."""
        made = super().__call__()
        initialize: Any = getattr(cls, "__init__")  # noqa: B009  # mypy refuses the other form
        initialize(made, *args, **members)
        return made


def _values(message: Any) -> dict[str, Any]:
    fields = {name: getattr(message, name) for name in message.__struct_fields__}
    return {**fields, **vars(message)}


def _reduce(message: Any) -> tuple[Any, ...]:
    return _made, (type(message), _values(message))


def _copy(message: Any) -> Any:
    return _made(type(message), _values(message))


def _made(cls: Any, values: dict[str, Any]) -> Any:
    """Return an instance of a derived class, without calling its ``__init__``."""
    made = msgspec.StructMeta.__call__(cls)
    for name, value in values.items():
        setattr(made, name, value)
    return made


def _initialize(self: Any, *args: Any, **members: Any) -> None:
    """Set fields by position or name; derived classes call it as ``Base.__init__``."""
    names = self.__struct_fields__
    if len(args) > len(names):
        raise TypeError(f"expected at most {len(names)} values, got {len(args)}")
    given = {**dict(zip(names, args, strict=False)), **_renamed(type(self), members)}
    for name, value in given.items():
        if value is not None:
            setattr(self, name, value)


def _equal(self: Any, other: Any) -> Any:
    """Compare messages that have sequences.

    A field that is a list in a new message is an array, a tuple or bytes in a received one.
    """
    if type(self) is not type(other):
        return NotImplemented
    for name, _, suffix in self._schema:
        ours, theirs = getattr(self, name), getattr(other, name)
        if suffix and (type(ours) is not type(theirs) or hasattr(ours, "dtype")):
            ours, theirs = _elements(ours), _elements(theirs)
        if ours != theirs:
            return False
    return True


def _elements(values: Any) -> Any:
    if hasattr(values, "tolist"):
        return values.tolist()
    return values if isinstance(values, str) or not hasattr(values, "__iter__") else list(values)


def _unequal(self: Any, other: object) -> Any:
    equal = self.__eq__(other)
    return equal if equal is NotImplemented else not equal


class Message(msgspec.Struct, gc=False):
    """Base of all message classes.

    Fields are given by position or name; missing ones get their defaults. Instances are compared by
    value, sequences by their elements whatever their types, and can be copied and pickled.

    Attributes:
        _type: ROS 1 name, ``geometry_msgs/Twist``.
        _type_name: ROS 2 name, ``geometry_msgs/msg/Twist``.
        _type_hash: RIHS01 hash, part of the key that the type is published under.
        _md5sum: Hash that ROS 1 identifies the definition by.
        _text: Text of the definition.
        _full_text: Text of the definition and of all types in it, as ROS 1 bags hold it.
        _slot_types: ROS 1 types of the fields, in the order of ``__slots__``.
        _has_header: Whether the first field is a ``std_msgs/Header`` named header.
        _ros1_names: Names of fields by the other names that ROS 1 has for them.
        _sequenced: Whether it has ROS 1's sequence number, which is not in the schema.
        _encode_ros1: Function that returns a message in ROS 1's byte layout.
        _decode_ros1: Function that returns the message in such bytes.
    """

    _type: ClassVar[str] = ""
    _type_name: ClassVar[str] = ""
    _type_hash: ClassVar[str] = ""
    _md5sum: ClassVar[str] = ""
    _text: ClassVar[str] = ""
    _schema: ClassVar[Schema] = ()
    _ros1_names: ClassVar[dict[str, str]] = {}
    _sequenced: ClassVar[bool] = False
    _full_text = _Derived(_full_text)
    _slot_types = _Derived(_slot_types)
    _has_header = _Derived(_has_header)
    __slots__: ClassVar[list[str]]  # fields in the order of the definition

    def __init_subclass__(cls, **_options: object) -> None:
        cls.__slots__ = [name for name, _, _ in cls._schema]
        members = vars(cls).get("_schema", ())
        if any(suffix or getattr(kind, "__eq__", None) is _equal for _, kind, suffix in members):
            setattr(cls, "__eq__", _equal)  # noqa: B010  # mypy refuses an assignment
            setattr(cls, "__ne__", _unequal)  # noqa: B010

    @staticmethod
    def _encode(m: Any) -> bytes:
        """Return the message as CDR with its header; the generated fast path."""
        raise NotImplementedError(type(m).__name__)

    @staticmethod
    def _decode(data: bytes) -> Any:
        """Return the message in these bytes; the generated fast path."""
        raise NotImplementedError(f"{len(data)} bytes")

    _encode_ros1: ClassVar[Any] = _Ros1Codec("compile_encoder")
    _decode_ros1: ClassVar[Any] = _Ros1Codec("compile_decoder")

    def to_cdr(self) -> bytes:
        """Return the message as XCDR1 little-endian bytes, with the 4-byte header.

        Raises:
            EncodeError: A value does not fit its field; the error names type, field and value.
        """
        return self._encode(self)

    @classmethod
    def from_cdr(cls, data: bytes | bytearray | memoryview) -> Self:
        """Return the message in CDR bytes of either byte order.

        Raises:
            DecodeError: The bytes are not a message of this type; the error says where and why.
        """
        message: Self = cls._decode(data if type(data) is bytes else bytes(data))
        return message

    def to_ros1(self) -> bytes:
        """Return the message in ROS 1's byte layout, in which bags and TCPROS hold it.

        Raises:
            EncodeError: A value does not fit its field, or ROS 1 has no such type.
        """
        encoded: bytes = self._encode_ros1(self)
        return encoded

    @classmethod
    def from_ros1(cls, data: bytes | bytearray | memoryview) -> Self:
        """Return the message in bytes of ROS 1's layout; what lies behind it is ignored.

        Raises:
            DecodeError: The bytes are not a message of this type; the error says where and why.
        """
        message: Self = cls._decode_ros1(data if type(data) is bytes else bytes(data))
        return message

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Return the types of the fields by name, as rclpy spells them."""
        return {slot.name: rclpy_type(slot) for slot in slots(cls)}

    def serialize(self, buff: Writable) -> None:
        """Write ROS 1's bytes into a file-like object (genpy's spelling of :meth:`to_ros1`).

        Raises:
            EncodeError: A value does not fit its field.
        """
        data = self.to_ros1()
        if data:  # an empty message is written to streams of text, too, as in genpy
            buff.write(data)

    def deserialize(self, data: bytes) -> Self:
        """Fill this message from ROS 1's bytes and return it (genpy's spelling).

        Raises:
            DecodeError: The bytes are not a message of this type.
        """
        from rosz.message.tuples import ros1_tuple_decoder

        other = ros1_tuple_decoder(type(self))(bytes(data or b""))
        for name in self.__struct_fields__:
            setattr(self, name, getattr(other, name))
        return self

    def _get_types(self) -> list[str]:
        return self._slot_types

    def _check_types(self, exc: Exception | None = None) -> None:  # noqa: ARG002  # genpy's
        self.to_ros1()

    def __str__(self) -> str:
        from rosz.message.text import strify_message

        return strify_message(self)


# Not a member of the class: msgspec makes instances without it, and refuses it there.
Message.__init__ = _initialize  # type: ignore[method-assign]


class Sequenced(Message):
    """A header with ROS 1's sequence number.

    The number is not on the wire; a receiver takes it from the attachment of the sample. It is not
    compared. As in ROS 1 it is the first argument: ``Header(0, stamp, "map")``.
    """

    seq: int = 0
    _sequenced: ClassVar[bool] = True

    def __init_subclass__(cls, **options: object) -> None:
        super().__init_subclass__(**options)
        cls.__slots__ = ["seq", *cls.__slots__]

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(getattr(self, n) == getattr(other, n) for n, _, _ in self._schema)

    def __ne__(self, other: object) -> bool:
        equal: bool = _unequal(self, other)
        return equal


def ros1_slots(cls: Any) -> dict[str, Slot]:
    """Return the fields of a message class that have another name in ROS 1, or are only there."""
    own = {slot.name: slot for slot in slots(cls)}
    renamed = {old: own[new] for old, new in cls._ros1_names.items()}
    return {**renamed, "seq": SEQ} if issubclass(cls, Sequenced) else renamed


class Stamped(Message):
    """A message that begins with a header; None in its place is the default, as in genpy.

    So is None in other fields then. Other messages do not check this, which would double the time
    that they take to make.
    """

    def __post_init__(self) -> None:
        """Set fields that are None to their defaults if the header is None."""
        message: Any = self
        if message.header is None:
            default = msgspec.StructMeta.__call__(type(self))
            for name in self.__struct_fields__:
                if getattr(self, name) is None:
                    setattr(self, name, getattr(default, name))


class Renamed(Stamped, metaclass=_TakesRos1Names):
    """A message whose constructor takes ROS 1's names of fields, such as ``CameraInfo(K=…)``."""


class Ros2Default:
    """Makes the default of a field that ROS 1 has with zero, such as ``Quaternion.w``.

    Args:
        value: Default in ROS 2.

    Attributes:
        ros1: Whether ROS 1's defaults hold in this process; constructors take nothing that could
            tell. What makes ROS 1's names importable sets it.
    """

    ros1: ClassVar[bool] = False

    def __init__(self, value: float) -> None:
        self._value = value
        self._zero = type(value)(0)

    def __repr__(self) -> str:
        return f"Ros2Default({self._value})"

    def __call__(self) -> Any:
        """Return the default."""
        return self._zero if Ros2Default.ros1 else self._value


class Service:
    """Base of all service classes; never instantiated.

    Attributes:
        Request: Class of requests (also ``_request_class``).
        Response: Class of responses (also ``_response_class``).
    """

    Request: ClassVar[type[Message]]
    Response: ClassVar[type[Message]]
    _type: ClassVar[str] = ""
    _type_name: ClassVar[str] = ""
    _type_hash: ClassVar[str] = ""
    _md5sum: ClassVar[str] = ""
    _text: ClassVar[str] = ""
    _full_text = _Derived(_full_text)
    _request_class = _Derived(lambda cls: cls.Request)
    _response_class = _Derived(lambda cls: cls.Response)


class Action:
    """Base of all action classes; never instantiated.

    Attributes:
        Goal: Class of goals.
        Result: Class of results.
        Feedback: Class of feedback.
        FeedbackMessage: Class of the messages that carry feedback.
        SendGoal: Class of the service that sends goals.
        GetResult: Class of the service that returns results.
        Impl: Where ROS 2 has ``FeedbackMessage``, ``SendGoalService`` and ``GetResultService``.
        _type_name: ROS 2 name, ``example_interfaces/action/Fibonacci``.
        _type_hash: RIHS01 hash.
        _text: Text of the definition.
    """

    Goal: ClassVar[type[Any]]
    Result: ClassVar[type[Any]]
    Feedback: ClassVar[type[Any]]
    FeedbackMessage: ClassVar[type[Any]]
    SendGoal: ClassVar[type[Service]]
    GetResult: ClassVar[type[Service]]
    GetResultService: _Derived[type[Service]] = _Derived(lambda cls: cls.GetResult)
    SendGoalService: _Derived[type[Service]] = _Derived(lambda cls: cls.SendGoal)
    Impl: _Derived[type[Any]] = _Derived(lambda cls: cls)
    _type_name: ClassVar[str] = ""
    _type_hash: ClassVar[str] = ""
    _text: ClassVar[str] = ""
