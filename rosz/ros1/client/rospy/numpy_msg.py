"""rospy.numpy_msg: messages with numpy arrays (ROS wiki, rospy_tutorials/Tutorials/numpy)."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosz.errors import UsageError
from rosz.message import ARRAY_CODES, Message, slots

__all__ = ("numpy_msg",)


@cache
def numpy_msg(msg_type: type[Any]) -> type[Any]:
    """Return a subclass of a message class with numpy arrays for sequences of numbers.

    Nested messages have arrays too. As in rospy, sequences of octets stay ``bytes``. The class
    works for publishers and subscribers.

    Args:
        msg_type: Message class.

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

    def deserialize(self: Any, data: bytes) -> Any:
        msg_type.deserialize(self, data)
        _convert(self, np)
        return self

    members = {
        "_decode": staticmethod(decode),
        "deserialize": deserialize,
        "__module__": msg_type.__module__,
    }
    package = msg_type._type.replace("/", "__")
    metaclass: Any = type(msg_type)
    made: type[Any] = metaclass(f"Numpy_{package}", (msg_type,), members)
    return made


def _convert(message: Message, np: Any) -> None:
    """Convert the numeric sequences of a message to arrays, in place."""
    for slot in slots(type(message)):
        value = getattr(message, slot.name)
        if isinstance(value, Message):
            _convert(value, np)
        elif isinstance(value, list) and value and isinstance(value[0], Message):
            for each in value:
                _convert(each, np)
        elif slot.shape != "one" and slot.kind in ARRAY_CODES:
            # Python and numpy have the same type codes; the array uses the same memory.
            kind = ARRAY_CODES[str(slot.kind)]
            make = np.array if type(value) is tuple else np.frombuffer
            setattr(message, slot.name, make(value, dtype=kind))
