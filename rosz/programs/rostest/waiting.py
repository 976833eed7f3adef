"""What the test programs share: their parameters, and waiting."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import msgspec

from rosz.ros1 import rospy

__all__ = ("Expected", "expectations", "wait_until")

_LOOK_SECONDS = 0.05


class Expected(msgspec.Struct, frozen=True):
    """A topic or service that is expected, as a parameter describes it.

    Attributes:
        name: Its name.
        timeout: Seconds within which it appears.
        type: Its type; None for any.
        negative: Whether it must not appear.
    """

    name: str
    timeout: float = 10
    type: str | None = None
    negative: bool = False


def expectations(param: str) -> list[Expected]:
    """Return what a parameter lists.

    Args:
        param: Name of the parameter.

    Raises:
        AssertionError: The parameter is not such a list.
    """
    try:
        return msgspec.convert(rospy.get_param(param, []), list[Expected])
    except msgspec.ValidationError as error:
        raise AssertionError(f"parameter '{param}' is not valid: {error}") from error


def wait_until(condition: Callable[[], Any], seconds: float) -> bool:
    """Wait until a condition holds, in wall time; return whether it does.

    Args:
        condition: The condition.
        seconds: Longest time to wait.
    """
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end or rospy.is_shutdown():
            return False
        time.sleep(_LOOK_SECONDS)
    return True
