"""rclpy.duration: spans of time."""

from __future__ import annotations

from typing import Any, Self

from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.qos import FOREVER

__all__ = ("Duration", "Infinite")

_SECOND = 1_000_000_000


class Duration:
    """A span of time, perhaps a negative one.

    Args:
        seconds: Seconds, of which fractions count.
        nanoseconds: Nanoseconds beside them.
    """

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        self._nanoseconds = int(seconds * _SECOND) + int(nanoseconds)

    @property
    def nanoseconds(self) -> int:
        """How long it is, in nanoseconds."""
        return self._nanoseconds

    def to_msg(self) -> DurationMessage:
        """Return it as a message."""
        message: DurationMessage = DurationMessage.from_nsec(self._nanoseconds)
        return message

    @classmethod
    def from_msg(cls, msg: Any) -> Self:
        """Return what a message says."""
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec)

    def __repr__(self) -> str:
        return f"Duration(nanoseconds={self._nanoseconds})"

    def __str__(self) -> str:
        return f"{self._nanoseconds} nanoseconds"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Duration) and self._nanoseconds == other.nanoseconds

    def __hash__(self) -> int:
        return hash(self._nanoseconds)

    def __lt__(self, other: Duration) -> bool:
        return self._nanoseconds < other.nanoseconds

    def __le__(self, other: Duration) -> bool:
        return self._nanoseconds <= other.nanoseconds

    def __gt__(self, other: Duration) -> bool:
        return self._nanoseconds > other.nanoseconds

    def __ge__(self, other: Duration) -> bool:
        return self._nanoseconds >= other.nanoseconds


Infinite = Duration(nanoseconds=FOREVER)
