"""A DiagnosticStatus with methods that fill it."""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

from typing import Any

from rosz.msgs.diagnostic_msgs.msg import DiagnosticStatus, KeyValue

__all__ = ("ERROR", "OK", "WARN", "DiagnosticStatusWrapper")

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN
ERROR = DiagnosticStatus.ERROR

_ONE = 1


class DiagnosticStatusWrapper(DiagnosticStatus):
    """A DiagnosticStatus that is easy to fill; it is published as one."""

    def summary(self, *args: Any) -> None:
        """Set level and message: ``summary(level, message)``, or those of a ``summary(status)``."""
        self.level, self.message = _parts(args)

    def clearSummary(self) -> None:
        """Set the level to OK and the message to nothing."""
        self.summary(OK, "")

    def mergeSummary(self, *args: Any) -> None:
        """Add another summary, given as to `summary`.

        The higher level stays. Of two that are OK, or of two that are not, both messages stay, with
        a semicolon between them; otherwise that of the one that is not OK.
        """
        level, message = _parts(args)
        if (level > OK) == (self.level > OK):
            self.message = f"{self.message}; {message}" if self.message else message
        elif level > self.level:
            self.message = message
        self.level = max(self.level, level)

    def add(self, key: str, val: Any) -> None:
        """Add a detail, as text."""
        self.values.append(KeyValue(key, str(val)))


def _parts(args: tuple[Any, ...]) -> tuple[int, str]:
    if len(args) == _ONE:
        return args[0].level, args[0].message
    level, message = args
    return level, str(message)
