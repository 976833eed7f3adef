"""Functions of a program that make requests of user data, and put responses into it."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rosz.ros1 import rospy
from rosz.ros1.smach import InvalidStateError, Remapper, State, has_smach_interface

__all__ = ("CallbackFailed", "UserCallback", "copy_from", "copy_to", "fill")


class CallbackFailed(Exception):
    """A function of the program failed, or user data lacks a key; the log has the reason."""


class UserCallback:
    """A function that sees the user data of a state.

    Args:
        state: The state; the keys and outcomes that the function declares are added to it.
        function: The function, or None.
        args: Further arguments.
        kwargs: Further keyword arguments.
        keys: Input and output keys of a function that declares none.

    Raises:
        InvalidStateError: The function is not callable.
    """

    def __init__(
        self,
        state: State,
        function: Callable[..., Any] | None,
        args: Sequence[Any] = (),
        kwargs: Mapping[str, Any] | None = None,
        keys: tuple[Iterable[str], Iterable[str]] = ((), ()),
    ) -> None:
        if function is not None and not callable(function):
            raise InvalidStateError(f"{function!r} is not callable")
        self._state = state
        self._function = function
        self._args = args
        self._kwargs = kwargs or {}
        self._inputs, self._outputs = map(tuple, keys)
        if has_smach_interface(function):
            declared: Any = function
            self._inputs = declared.get_registered_input_keys()
            self._outputs = declared.get_registered_output_keys()
            state.register_outcomes(declared.get_registered_outcomes())
        state.register_input_keys(self._inputs)
        state.register_output_keys(self._outputs)

    def call(self, what: str, ud: Any, *given: Any) -> Any:
        """Call the function with user data; return None if there is none.

        Args:
            what: What it is, for the log.
            ud: User data of the state.
            given: Arguments before those of the program.

        Raises:
            CallbackFailed: It failed.
        """
        if self._function is None:
            return None
        seen = Remapper(ud, self._inputs, self._outputs)
        try:
            return self._function(seen, *given, *self._args, **self._kwargs)
        except Exception as error:
            rospy.logerr(f"{what} failed: {traceback.format_exc()}")
            raise CallbackFailed from error

    def choose(self, what: str, ud: Any, *given: Any) -> Any:
        """Call the function, and return the outcome that it chooses, or None.

        Args:
            what: What it is, for the log.
            ud: User data of the state.
            given: Arguments before those of the program.

        Raises:
            CallbackFailed: It failed, or the state has no such outcome.
        """
        outcome = self.call(what, ud, *given)
        known = self._state.get_registered_outcomes()
        if outcome is not None and outcome not in known:
            rospy.logerr(f"{what} returned {outcome!r}; expected None or one of {list(known)}")
            raise CallbackFailed
        return outcome


def copy_from(ud: Any, key: str) -> Any:
    """Return a value of user data.

    Args:
        ud: User data of a state.
        key: Key of the value.

    Raises:
        CallbackFailed: The key does not exist.
    """
    if key not in ud:
        rospy.logerr(f"user data has no key '{key}'; it has {ud.keys()}")
        raise CallbackFailed
    return ud[key]


def fill(message: Any, ud: Any, slots: Iterable[str]) -> None:
    """Set fields of a message from user data.

    Args:
        message: The message.
        ud: User data of a state.
        slots: Fields, which are keys too.

    Raises:
        CallbackFailed: The key does not exist.
    """
    for slot in slots:
        setattr(message, slot, copy_from(ud, slot))


def copy_to(ud: Any, message: Any, key: str | None, slots: Iterable[str]) -> None:
    """Put a message and fields of it into user data.

    Args:
        ud: User data of a state.
        message: The message.
        key: Key for the message, or None.
        slots: Fields, which are keys too.
    """
    if key is not None:
        ud[key] = message
    if message is not None:
        for slot in slots:
            ud[slot] = getattr(message, slot)
