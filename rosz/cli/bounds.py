"""Numbers of a command line, held to what makes sense."""

from __future__ import annotations

from rosz.errors import UsageError

__all__ = ("at_least", "per_second", "seconds")

_LONGEST = 1e9
"""Thirty years: what waits for longer is a slip, and more than some clocks of the system hold."""
_MOST = 1_000_000_000


def seconds(option: str, value: float) -> float:
    """Return how long something may take.

    Args:
        option: What gives it.
        value: Seconds.

    Raises:
        UsageError: It is no time.
    """
    if not 0 < value <= _LONGEST:
        raise UsageError(f"{option} is {value:g}; expected seconds above 0, at most {_LONGEST:g}")
    return value


def per_second(option: str, value: float) -> float:
    """Return how often something is to be done.

    Args:
        option: What gives it.
        value: Times a second.

    Raises:
        UsageError: It is no rate.
    """
    if not 1 / _LONGEST <= value <= _MOST:
        raise UsageError(f"{option} is {value:g}; expected a rate above 0, at most {_MOST:g} Hz")
    return value


def at_least(option: str, value: int, fewest: int, what: str, most: int = _MOST) -> int:
    """Return how many of something there are to be.

    Args:
        option: What gives it.
        value: The number.
        fewest: Least number.
        what: Of what, in the plural.
        most: Largest number.

    Raises:
        UsageError: It is fewer or more.
    """
    if value < fewest:
        raise UsageError(f"{option} is {value}; expected {fewest} or more {what}")
    if value > most:
        raise UsageError(f"{option} is {value}; expected at most {most} {what}")
    return value
