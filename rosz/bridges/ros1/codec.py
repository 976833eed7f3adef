"""Message types on both sides: ROS 1's bytes to CDR and back.

Bytes are translated without becoming messages where both layouts have the same fields; see
`rosz.message.transcode`. The messages of ``/rosout`` are of another type in ROS 2.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.bridges.logs import LOGS, to_ros1_log, to_ros2_log
from rosz.errors import TypeNotFound
from rosz.message.transcode import compile_from_cdr, compile_transcoder
from rosz.qos import ROSOUT, QoS

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.typestore import TypeStore

__all__ = ("Codec", "Codecs")

_LOG = "rosgraph_msgs/Log"
_LOG_OF_ROS2 = "rcl_interfaces/Log"


class Codec(msgspec.Struct, frozen=True):
    """A message type on both sides.

    Attributes:
        ros1_type: Name in ROS 1, such as ``std_msgs/String``.
        md5sum: Hash of ROS 1's definition.
        definition: Full text of ROS 1's definition.
        cls: Class on the network.
        to_cdr: Function that makes CDR of ROS 1's bytes; raises DecodeError.
        from_cdr: Function that makes ROS 1's bytes, in parts, of CDR and a sequence number as four
            bytes; raises DecodeError and EncodeError.
        qos: Quality of service that publishers on the network have; None for the usual one.
    """

    ros1_type: str
    md5sum: str
    definition: str
    cls: type[Message]
    to_cdr: Callable[[Any], bytes]
    from_cdr: Callable[[bytes, bytes], list[Any]]
    qos: QoS | None = None

    def fits(self, md5sum: str) -> bool:
        """Return whether a hash in a connection header means this type."""
        return md5sum in {"*", self.md5sum}


class Codecs:
    """The codecs of a bridge, made at first use. Safe for threads.

    Args:
        types: Message types by name.
    """

    def __init__(self, types: TypeStore) -> None:
        self._types = types
        self._lock = threading.RLock()
        self._made: dict[tuple[type[Any], type[Any]], Codec] = {}

    def of_ros1(self, topic: str, type_name: str, definition: str = "") -> Codec:
        """Return the codec for a topic of ROS 1.

        Args:
            topic: Name of the topic.
            type_name: Type in ROS 1.
            definition: Full text of the definition, if the program has sent it.

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

        Args:
            topic: Name of the topic.
            type_name: Type as a token names it, such as ``std_msgs/msg/String``.
            type_hash: Hash of its definition there.

        Raises:
            TypeNotFound: The type is not known, or another one of that name is.
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
        made = self._made.get((ros1, network))
        if made is None:
            to_cdr: Callable[[Any], bytes]
            from_cdr: Callable[[bytes, bytes], list[Any]]
            if ros1 is network:
                to_cdr = compile_transcoder(ros1, lambda data: _to_cdr(ros1, data))
                from_cdr = compile_from_cdr(ros1, lambda data, seq: _from_cdr(ros1, data, seq))
            else:
                to_cdr, from_cdr = _log_codecs(ros1, network)
            qos = None if ros1 is network else ROSOUT
            made = Codec(ros1._type, ros1._md5sum, ros1._full_text, network, to_cdr, from_cdr, qos)
            self._made[ros1, network] = made
        return made


def _to_cdr(cls: type[Message], data: Any) -> bytes:
    return cls.from_ros1(data).to_cdr()


def _from_cdr(cls: type[Message], data: bytes, seq: bytes) -> bytes:
    message: Any = cls.from_cdr(data)
    if cls._has_header:
        message.header.seq = int.from_bytes(seq, "little")
    encoded: bytes = message.to_ros1()
    return encoded


def _log_codecs(
    ros1: type[Any], network: type[Any]
) -> tuple[Callable[[Any], bytes], Callable[[bytes, bytes], list[Any]]]:
    """Return the codecs between ROS 1's and ROS 2's messages of ``/rosout``."""

    def to_cdr(data: Any) -> bytes:
        return to_ros2_log(ros1.from_ros1(data)).to_cdr()

    def from_cdr(data: bytes, seq: bytes) -> list[Any]:
        message = to_ros1_log(network.from_cdr(data))
        message.header.seq = int.from_bytes(seq, "little")
        return [message.to_ros1()]

    return to_cdr, from_cdr
