"""Conversion of messages between ROS 1's bytes and CDR.

Where both layouts have the same fields, bytes are converted without message objects; see
`rosz.message.compile_transcoder`. Messages of ``/rosout`` have another type in ROS 2.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import msgspec

from rosz.errors import TypeNotFound
from rosz.introspect import LOGS, to_ros1_log, to_ros2_log
from rosz.message import Message, compile_from_cdr, compile_transcoder
from rosz.qos import ROSOUT, QoS
from rosz.typestore import TypeStore

_LOG = "rosgraph_msgs/Log"
_LOG_OF_ROS2 = "rcl_interfaces/Log"


class Codec(msgspec.Struct, frozen=True):
    """A message type of ROS 1, its type on the network, and the conversion between both.

    Attributes:
        ros1_type: Name in ROS 1, such as ``std_msgs/String``.
        md5sum: Hash of ROS 1's definition.
        definition: Full text of ROS 1's definition.
        cls: Class on the network.
        to_cdr: Function that converts ROS 1's bytes to CDR; raises DecodeError.
        from_cdr: Function that converts CDR and a sequence number of four bytes to parts of ROS
            1's bytes; raises DecodeError and EncodeError.
        qos: Quality of service of publishers on the network; None for the default.
    """

    ros1_type: str
    md5sum: str
    definition: str
    cls: type[Message]
    to_cdr: Callable[[Any], bytes]
    from_cdr: Callable[[bytes, bytes], list[Any]]
    qos: QoS | None = None

    def fits(self, md5sum: str) -> bool:
        """Return whether an md5 in a connection header matches this type."""
        return md5sum in {"*", self.md5sum}


class Codecs:
    """The codecs of a bridge, made on first use. The class is thread-safe."""

    def __init__(self, types: TypeStore) -> None:
        self._types = types
        self._lock = threading.RLock()
        self._made: dict[tuple[type[Any], type[Any]], Codec] = {}

    def of_ros1(self, topic: str, type_name: str, definition: str = "") -> Codec:
        """Return the codec for a topic of ROS 1.

        Raises:
            TypeNotFound: The type is not known, and no definition was given.
            DefinitionError: The definition is not well-formed.
        """
        with self._lock:
            if definition.strip():
                cls = self._types.message_from_text(type_name, definition)
            else:
                cls = self._types.message(type_name)
            if (topic, cls._type) == (LOGS, _LOG):
                return self._make(cls, self._types.message(_LOG_OF_ROS2))
            return self._make(cls, cls)

    def of_network(self, topic: str, type_name: str, type_hash: str) -> Codec:
        """Return the codec for a topic of the network.

        Raises:
            TypeNotFound: The type is not known, or its definition differs from the known one.
            DefinitionError: The definition is not well-formed.
        """
        with self._lock:
            cls = self._types.message(type_name)
            if type_hash.startswith("RIHS01_") and type_hash != cls._type_hash:
                raise TypeNotFound(type_name, "its definition there is not the one known here")
            if (topic, cls._type) == (LOGS, _LOG_OF_ROS2):
                return self._make(self._types.message(_LOG), cls)
            return self._make(cls, cls)

    def _make(self, ros1: type[Message], network: type[Message]) -> Codec:
        codec = self._made.get((ros1, network))
        if codec is None:
            codec = _same_codec(ros1) if ros1 is network else _log_codec(ros1, network)
            self._made[ros1, network] = codec
        return codec


def _same_codec(cls: type[Any]) -> Codec:
    """Return the codec of a type that is the same on both sides."""

    def to_cdr(data: Any) -> bytes:
        encoded: bytes = cls.from_ros1(data).to_cdr()
        return encoded

    def from_cdr(data: bytes, seq: bytes) -> bytes:
        message = cls.from_cdr(data)
        if cls._has_header:
            message.header.seq = int.from_bytes(seq, "little")
        encoded: bytes = message.to_ros1()
        return encoded

    codecs = compile_transcoder(cls, to_cdr), compile_from_cdr(cls, from_cdr)
    return Codec(cls._type, cls._md5sum, cls._full_text, cls, *codecs)


def _log_codec(ros1: type[Any], network: type[Any]) -> Codec:
    """Return the codec between ROS 1's and ROS 2's messages of ``/rosout``."""

    def to_cdr(data: Any) -> bytes:
        return to_ros2_log(ros1.from_ros1(data)).to_cdr()

    def from_cdr(data: bytes, seq: bytes) -> list[Any]:
        message = to_ros1_log(network.from_cdr(data))
        message.header.seq = int.from_bytes(seq, "little")
        return [message.to_ros1()]

    return Codec(ros1._type, ros1._md5sum, ros1._full_text, network, to_cdr, from_cdr, ROSOUT)
