"""roslib.message: what genpy has, under the name that it had before."""

from rosz.ros1.genpy.message import (
    DeserializationError,
    Duration,
    Message,
    SerializationError,
    Time,
    check_type,
    fill_message_args,
    get_message_class,
    get_printable_message_args,
    get_service_class,
    strify_message,
)
from rosz.ros1.genpy.rostime import TVal

__all__ = (
    "DeserializationError",
    "Duration",
    "Message",
    "SerializationError",
    "TVal",
    "Time",
    "check_type",
    "fill_message_args",
    "get_message_class",
    "get_printable_message_args",
    "get_service_class",
    "strify_message",
)
