"""ros_numpy.registry: which function converts which message."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from rosz.message import Message
from rosz.ros1.rospy.numpy_msg import numpy_msg

__all__ = ("converts_from_numpy", "converts_to_numpy", "msgify", "numpify", "numpy_msg")

Converter = Callable[..., Any]
_F = TypeVar("_F", bound=Converter)

_to_numpy: dict[tuple[type[Any], bool], Converter] = {}
_from_numpy: dict[tuple[type[Any], bool], Converter] = {}


def converts_to_numpy(msgtype: type[Any], plural: bool = False) -> Callable[[_F], _F]:
    """Declare that a function makes arrays of messages, or of lists of them.

    Raises:
        TypeError: The type is not a message class.
    """
    return _declaring(_to_numpy, msgtype, plural)


def converts_from_numpy(msgtype: type[Any], plural: bool = False) -> Callable[[_F], _F]:
    """Declare that a function makes messages of arrays, or lists of them.

    Raises:
        TypeError: The type is not a message class.
    """
    return _declaring(_from_numpy, msgtype, plural)


def numpify(msg: Any, *args: Any, **kwargs: Any) -> Any:
    """Return the array of a message or of a list of messages; None for None.

    Args:
        msg: The message or list.
        args: Further arguments of the function that converts it.
        kwargs: Likewise.

    Raises:
        ValueError: Messages of that type have no array, or the list is empty.
    """
    if msg is None:
        return None
    convert = _find(_to_numpy, type(msg), plural=False)
    if convert is None and isinstance(msg, Sequence):
        if not msg:
            raise ValueError("an empty list does not say of what it is; expected messages")
        convert = _find(_to_numpy, type(msg[0]), plural=True)
    if convert is None:
        raise ValueError(f"no array for {type(msg).__name__}; expected {_names(_to_numpy)}")
    return convert(msg, *args, **kwargs)


def msgify(msg_type: type[Any], numpy_obj: Any, *args: Any, **kwargs: Any) -> Any:
    """Return the message of an array.

    Args:
        msg_type: Class of the message.
        numpy_obj: The array.
        args: Further arguments of the function that converts it.
        kwargs: Likewise; ``plural=True`` returns a list of messages.

    Raises:
        ValueError: Messages of that type are not made of arrays.
    """
    convert = _find(_from_numpy, msg_type, plural=kwargs.pop("plural", False))
    if convert is None:
        raise ValueError(f"no {msg_type.__name__} of an array; expected {_names(_from_numpy)}")
    return convert(numpy_obj, *args, **kwargs)


def _declaring(
    table: dict[tuple[type[Any], bool], Converter], msgtype: type[Any], plural: bool
) -> Callable[[_F], _F]:
    if not issubclass(msgtype, Message):
        raise TypeError(f"expected a message class, got {msgtype.__name__}")

    def declare(function: _F) -> _F:
        table[msgtype, plural] = function
        return function

    return declare


def _find(
    table: dict[tuple[type[Any], bool], Converter], msgtype: type[Any], *, plural: bool
) -> Converter | None:
    """Return the function of a class, or of the class that `numpy_msg` made it of."""
    found = (table.get((each, plural)) for each in msgtype.__mro__)
    return next((function for function in found if function is not None), None)


def _names(table: dict[tuple[type[Any], bool], Converter]) -> str:
    return ", ".join(sorted(f"{each.__name__}{'[]' * plural}" for each, plural in table))
