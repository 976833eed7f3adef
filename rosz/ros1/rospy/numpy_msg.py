"""Messages whose numeric sequences arrive as numpy arrays (ROS wiki, rospy_tutorials numpy)."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosz.errors import UsageError
from rosz.message import ARRAY_CODES, Message, slots
from rosz.ros1.rospy.absent import attribute

__all__ = ("numpy_msg",)


@cache
def numpy_msg(msg_type: type[Any]) -> type[Any]:
    """Return a class of the same messages, with numpy arrays for sequences of numbers.

    As in rospy, sequences of octets stay ``bytes``. The class serves publishers and
    subscribers alike; sequences in nested messages are arrays, too.

    Args:
        msg_type: Class of a message.

    Raises:
        UsageError: numpy is not installed.
    """
    try:
        import numpy as np
    except ImportError as error:
        raise UsageError("numpy_msg needs numpy: install it with 'pip install numpy'") from error

    def decode(data: bytes) -> Any:
        plain = msg_type._decode(data)
        _convert(plain, np)
        return made(**{name: getattr(plain, name) for name in plain.__struct_fields__})

    members = {"_decode": staticmethod(decode), "__module__": msg_type.__module__}
    package = msg_type._type.replace("/", "__")
    metaclass: Any = type(msg_type)
    made: type[Any] = metaclass(f"Numpy_{package}", (msg_type,), members)
    return made


def _convert(message: Message, np: Any) -> None:
    """Turn what a message holds of numeric sequences into arrays, in place."""
    for slot in slots(type(message)):
        value = getattr(message, slot.name)
        if isinstance(value, Message):
            _convert(value, np)
        elif isinstance(value, list) and value and isinstance(value[0], Message):
            for each in value:
                _convert(each, np)
        elif slot.shape != "one" and slot.kind in ARRAY_CODES:
            # Arrays of Python and numpy share their type codes, and here also the memory.
            setattr(message, slot.name, np.frombuffer(value, dtype=ARRAY_CODES[str(slot.kind)]))


__getattr__ = attribute(__name__)
