"""Limits of the numbers on a command line.

Each function takes the option that gives a number, for the text of the `UsageError`.
"""

from __future__ import annotations

from rosz.errors import UsageError

__all__ = ("at_least", "per_second", "seconds")

_MOST = 1_000_000_000
_LONGEST = 1e9
"""Thirty years. A longer time is a mistake, and more than some system clocks can hold."""


def seconds(option: str, value: float) -> float:
    """Return a time limit in seconds if it makes sense."""
    if not 0 < value <= _LONGEST:
        raise UsageError(f"{option} is {value:g}; expected seconds above 0, at most {_LONGEST:g}")
    return value


def per_second(option: str, value: float | None) -> None:
    """Check that a rate in hertz, if one is given, makes sense."""
    if value is not None and not 1 / _LONGEST <= value <= _MOST:
        raise UsageError(f"{option} is {value:g}; expected a rate above 0, at most {_MOST:g} Hz")


def at_least(option: str, value: int | None, fewest: int, what: str, most: int = _MOST) -> None:
    """Check that a number of things, if one is given, is in its bounds."""
    if value is not None and value < fewest:
        raise UsageError(f"{option} is {value}; expected {fewest} or more {what}")
    if value is not None and value > most:
        raise UsageError(f"{option} is {value}; expected at most {most} {what}")
