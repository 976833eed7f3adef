"""Limits of the numbers on a command line."""

from __future__ import annotations

from rosz.errors import UsageError

__all__ = ("at_least", "per_second", "seconds")

_MOST = 1_000_000_000
_LONGEST = 1e9
"""Thirty years. A longer time is a mistake, and more than some system clocks can hold."""


def seconds(option: str, value: float) -> float:
    """Return a time limit if it makes sense.

    Args:
        option: The option that gives it.
        value: The time limit in seconds.

    Raises:
        UsageError: The value is not a sensible time.
    """
    if not 0 < value <= _LONGEST:
        raise UsageError(f"{option} is {value:g}; expected seconds above 0, at most {_LONGEST:g}")
    return value


def per_second(option: str, value: float) -> float:
    """Return a rate if it makes sense.

    Args:
        option: The option that gives it.
        value: The rate in hertz.

    Raises:
        UsageError: The value is not a sensible rate.
    """
    if not 1 / _LONGEST <= value <= _MOST:
        raise UsageError(f"{option} is {value:g}; expected a rate above 0, at most {_MOST:g} Hz")
    return value


def at_least(option: str, value: int, fewest: int, what: str, most: int = _MOST) -> int:
    """Return a number if it is in its bounds.

    Args:
        option: The option that gives it.
        value: The number.
        fewest: The least number.
        what: The things that are counted, in the plural.
        most: The largest number.

    Raises:
        UsageError: The number is too small or too large.
    """
    if value < fewest:
        raise UsageError(f"{option} is {value}; expected {fewest} or more {what}")
    if value > most:
        raise UsageError(f"{option} is {value}; expected at most {most} {what}")
    return value
