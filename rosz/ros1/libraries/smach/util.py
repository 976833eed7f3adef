"""smach.util: the log and the errors, and callbacks that declare keys and outcomes.

``smach_ros`` replaces the log by rospy's.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from typing import Any

__all__ = (
    "CBInterface",
    "cb_interface",
    "has_smach_interface",
    "is_shutdown",
    "set_shutdown_check",
)

Logger = Callable[[str], object]


def _printer(level: str) -> Logger:
    def write(msg: str) -> None:
        sys.stdout.write(f"[{level:^7}] : {msg}\n")

    return write


_loggers = {level: _printer(level.upper()) for level in ("info", "warn", "debug", "error")}


def set_loggers(info: Logger, warn: Logger, debug: Logger, error: Logger) -> None:
    """Replace the functions that write messages, one of each level."""
    _loggers.update(info=info, warn=warn, debug=debug, error=error)


def _logger(level: str) -> Logger:
    def write(msg: str) -> None:
        """Write a message of the level to the log."""
        _loggers[level](msg)

    return write


loginfo, logwarn, logdebug, logerr = map(_logger, _loggers)


class SmachError(Exception):
    """Base class of the errors of smach."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        logerr(f"{type(self).__name__}: {message}")


class InvalidTransitionError(SmachError):
    """A transition is missing, or leads nowhere."""


class InvalidStateError(SmachError):
    """A state or a container is not valid."""


class InvalidConstructionError(SmachError):
    """A container was changed while it was not open."""


class InvalidUserCodeError(SmachError):
    """A state or a callback of the program failed."""


_INTERFACE = (
    "get_registered_input_keys",
    "get_registered_output_keys",
    "get_registered_outcomes",
)
_checks: list[Callable[[], bool]] = []


def is_shutdown() -> bool:
    """Return whether containers are to end; ``smach_ros`` lets them end with the node."""
    return any(check() for check in _checks)


def set_shutdown_check(cb: Callable[[], bool]) -> None:
    """Replace the function that `is_shutdown` calls."""
    _checks[:] = [cb]


def has_smach_interface(obj: Any) -> bool:
    """Return whether an object has the methods that declare keys and outcomes."""
    return all(hasattr(obj, name) for name in _INTERFACE)


class CBInterface:
    """A function that declares the user data which it uses and the outcomes which it returns.

    Args:
        cb: The function.
        outcomes: Outcomes that it adds to those of the state.
        input_keys: Keys of the user data that it reads.
        output_keys: Keys of the user data that it writes.
        io_keys: Keys of the user data that it reads and writes.
    """

    def __init__(
        self,
        cb: Callable[..., Any],
        outcomes: Iterable[str] | None = None,
        input_keys: Iterable[str] | None = None,
        output_keys: Iterable[str] | None = None,
        io_keys: Iterable[str] | None = None,
    ) -> None:
        both = tuple(io_keys or ())
        self._cb = cb
        self._outcomes = tuple(outcomes or ())
        self._input_keys = {*(input_keys or ()), *both}
        self._output_keys = {*(output_keys or ()), *both}

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the function."""
        return self._cb(*args, **kwargs)

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the keys that the function reads."""
        return tuple(self._input_keys)

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the keys that the function writes."""
        return tuple(self._output_keys)

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes that the function adds."""
        return self._outcomes


class cb_interface:  # noqa: N801  # smach's
    """Decorator that makes a function a `CBInterface`, whose arguments it takes."""

    def __init__(
        self,
        outcomes: Iterable[str] | None = None,
        input_keys: Iterable[str] | None = None,
        output_keys: Iterable[str] | None = None,
    ) -> None:
        self._interface = outcomes, input_keys, output_keys

    def __call__(self, cb: Callable[..., Any]) -> CBInterface:
        """Return the function with its interface."""
        return CBInterface(cb, *self._interface)
