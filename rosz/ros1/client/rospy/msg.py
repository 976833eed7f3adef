"""rospy.msg: messages of any type, and messages from the arguments of a call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from struct import Struct
from typing import Any, BinaryIO, ClassVar, Self

from rosz.errors import DecodeError, EncodeError
from rosz.message import Message, Writable
from rosz.ros1.exceptions import ROSException
from rosz.time import DurationValue, TimeValue

__all__ = (
    "AnyMsg",
    "args_kwds_to_message",
    "deserialize_messages",
    "encode",
    "in_words_of_genpy",
    "serialize_message",
    "to_ros1_log",
)

_SIZE = Struct("<I")
_STAMPS = (TimeValue, DurationValue)


class AnyMsg:
    """A message of any type, not decoded.

    Attributes:
        _buff: Bytes of the message in ROS 1's layout, or None. A received message is converted when
            they are asked for; reading them raises TypeNotFound where the type is not known here.
        _connection_header: ``type``, ``md5sum``, ``message_definition``, ``topic``, ``callerid``.
    """

    _md5sum: ClassVar[str] = "*"
    _type: ClassVar[str] = "*"
    _has_header: ClassVar[bool] = False
    _full_text: ClassVar[str] = ""
    __slots__ = ("_bytes", "_connection_header", "_find_type", "_payload")

    def __init__(self, *args: object) -> None:
        if args:
            raise ROSException("AnyMsg does not accept arguments")
        self._bytes: bytes | None = None
        self._payload: Any = None
        self._find_type: Any = None
        self._connection_header: dict[str, str] = {}

    @classmethod
    def received(
        cls, payload: bytes, header: dict[str, str], find_type: Callable[[str], type[Message]]
    ) -> Self:
        """Return the message of a sample in CDR, whose class is found by name when needed."""
        message = cls()
        message._bytes, message._payload = None, payload
        message._connection_header, message._find_type = header, find_type
        return message

    @property
    def _buff(self) -> bytes | None:
        if self._bytes is None and self._payload is not None:
            kind = self._find_type(self._connection_header["type"])
            self._bytes = kind.from_cdr(self._payload).to_ros1()
        return self._bytes

    @_buff.setter
    def _buff(self, data: bytes) -> None:
        self._bytes, self._payload = data, None

    def payload(self, kind: type[Message]) -> bytes:
        """Return the bytes in CDR of a message of a type.

        Raises:
            DecodeError: The bytes are not a message of this type.
            ROSException: There are no bytes.
        """
        return self._payload if self._payload is not None else kind.from_ros1(self._ros1()).to_cdr()

    def _ros1(self) -> bytes:
        data = self._buff
        if data is None:
            raise ROSException("AnyMsg is not initialized")
        return data

    def serialize(self, buff: Writable) -> None:
        """Write the bytes to a file-like object.

        Raises:
            ROSException: There are no bytes.
        """
        buff.write(self._ros1())

    def deserialize(self, data: bytes) -> Self:
        """Set the bytes."""
        self._buff = data
        return self


def args_kwds_to_message(
    data_class: type[Any], args: Sequence[Any], kwds: Mapping[str, Any]
) -> Any:
    """Return the message for the arguments of ``publish`` or a service call.

    Args:
        data_class: Message class.
        args: A message, or the values of all its fields.
        kwds: Values of some of its fields by name.

    Raises:
        TypeError: The arguments are neither, or the message has another type.
        AttributeError: The message does not have such a field.
    """
    if args and kwds:
        raise TypeError("publish() can be called with arguments or keywords, but not both.")
    if kwds:
        return _by_name(data_class, kwds)
    if len(args) == 1 and hasattr(args[0], "_md5sum") and not isinstance(args[0], _STAMPS):
        given = args[0]
        if given._md5sum in {data_class._md5sum, AnyMsg._md5sum} or data_class is AnyMsg:
            return given
        single = data_class._slot_types
        if len(single) == 1 and single[0] == given._type:
            return data_class(given)
        raise TypeError(f"expected [{(*single, data_class._type)[0]}] but got [{given._type}]")
    slots = list(data_class.__slots__)
    if not args:
        return data_class()
    if len(args) != len(slots):
        raise TypeError(
            f"Invalid number of arguments, args should be {slots} args are{tuple(args)}"
        )
    return _by_name(data_class, dict(zip(slots, args, strict=True)))


def _by_name(data_class: type[Any], fields: Mapping[str, Any]) -> Any:
    for name in fields:
        if name not in data_class.__slots__:
            raise AttributeError(f"{name} is not an attribute of {data_class.__name__}")
    return data_class(**{name: value for name, value in fields.items() if value is not None})


def serialize_message(b: BinaryIO, seq: int, msg: Any) -> None:
    """Write a message to a buffer behind its size, as TCPROS carries it.

    Args:
        b: The buffer; bytes behind its position are overwritten.
        seq: Sequence number for the header of the message, if it has one.
        msg: The message.

    Raises:
        EncodeError: A value does not fit its field.
    """
    if getattr(type(msg), "_has_header", False):
        msg.header.seq = seq
        if msg.header.frame_id is None:
            msg.header.frame_id = "0"
    data = BytesIO()
    msg.serialize(data)
    b.write(_SIZE.pack(data.tell()))
    b.write(data.getvalue())


def deserialize_messages(
    b: BinaryIO,
    msg_queue: list[Any],
    data_class: type[Any],
    queue_size: int | None = None,
    max_msgs: int | None = None,
    start: int = 0,
) -> None:
    """Take the complete messages in a buffer; the remaining bytes move to its start.

    Args:
        b: The buffer, up to its position.
        msg_queue: List to append the messages to.
        data_class: Message class.
        queue_size: Number of the newest messages to keep in the list; no limit when not given.
        max_msgs: Largest number of messages to take; no limit when not given.
        start: Position of the first message.

    Raises:
        DecodeError: The bytes are not messages of this type, or an argument is None.
    """
    if b is None or msg_queue is None:
        raise DecodeError(data_class._type, -1, "there is no buffer, or no list for messages")
    end = b.tell()
    b.seek(start)
    data = b.read(end - start)
    bodies: list[bytes] = []
    at = 0
    while len(data) - at >= _SIZE.size and not (max_msgs and len(bodies) >= max_msgs):
        (size,) = _SIZE.unpack_from(data, at)
        if len(data) - at - _SIZE.size < size:
            break
        at += _SIZE.size + size
        bodies.append(data[at - size : at])
    b.seek(start)
    b.truncate()
    b.write(data[at:])
    kept = slice(None) if queue_size is None else slice(-queue_size, None)
    msg_queue += [data_class().deserialize(body) for body in bodies[kept]]
    msg_queue[:] = msg_queue[kept]


def encode(message: Any) -> bytes:
    """Return the bytes of a message.

    Raises:
        EncodeError: A value does not fit its field; the text is that of genpy.
    """
    try:
        payload: bytes = message._encode(message)
    except EncodeError as error:
        raise in_words_of_genpy(message, error) from error
    return payload


def in_words_of_genpy(message: Any, error: EncodeError) -> EncodeError:
    """Return the error of genpy for an invalid message; the given one if genpy accepts it."""
    from rosz.ros1.client.genpy import check_type

    try:
        for name, kind in zip(message.__slots__, message._slot_types, strict=True):
            check_type(name, kind, getattr(message, name))
    except EncodeError as genpy_error:
        return genpy_error
    except AttributeError:  # genpy fails for a value that is not a message
        return error
    return error


def to_ros1_log(message: Any, topics_of: Callable[[str], Sequence[str]]) -> Any:
    """Convert a ROS 2 log message to ROS 1's, with the topics of its node."""
    from rosz import introspect

    log = introspect.to_ros1_log(message)
    log.topics = list(topics_of(log.name))
    return log
