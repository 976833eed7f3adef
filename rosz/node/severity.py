"""The five severities of ROS, which are the levels of Python's logging by other names."""

from __future__ import annotations

from bisect import bisect_right

from rosz.errors import UsageError, near_miss

__all__ = ("NAMES", "parse_severity", "severity", "severity_name")

NAMES = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
"""Severity to name; the numbers are those of rcl_interfaces/Log."""

_LEVELS = tuple(NAMES)
_BY_NAME = {name: level for level, name in NAMES.items()} | {"WARNING": 30, "CRITICAL": 50}


def severity(level: int) -> int:
    """Return the severity that a level of logging counts as: the next one not above it."""
    return _LEVELS[max(bisect_right(_LEVELS, level) - 1, 0)]


def severity_name(level: int) -> str:
    """Return ROS's name of a level of logging."""
    return NAMES[severity(level)]


def parse_severity(name: str) -> int:
    """Return the level that a name means, in any case, ROS's or Python's.

    Raises:
        UsageError: No level has that name.
    """
    level = _BY_NAME.get(name.upper())
    if level is None:
        hint = near_miss(name.upper(), NAMES.values())
        raise UsageError(f"'{name}' is no level: expected one of {', '.join(NAMES.values())}{hint}")
    return level
