"""The newest messages, by their stamps."""

from __future__ import annotations

from typing import Any

from rosz.ros1.message_filters.filters import SimpleFilter, stamp_of

__all__ = ("Cache",)


class Cache(SimpleFilter):
    """Keeps the newest messages of a source, and passes all on.

    Args:
        f: The source.
        cache_size: How many it keeps.
        allow_headerless: Whether messages without a stamp count as stamped when they come.
    """

    def __init__(
        self, f: SimpleFilter, cache_size: int = 1, allow_headerless: bool = False
    ) -> None:
        super().__init__()
        self.cache_size = cache_size
        self.cache_msgs: list[Any] = []
        self.cache_times: list[Any] = []
        self.allow_headerless = allow_headerless
        self.connectInput(f)

    def connectInput(self, f: SimpleFilter) -> None:  # noqa: N802  # ROS 1's
        """Take messages from a source."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Take a message in; of too many, that which came first goes."""
        stamp = stamp_of(msg, self.allow_headerless)
        if stamp is None:
            return
        if len(self.cache_msgs) >= self.cache_size:
            del self.cache_msgs[0], self.cache_times[0]
        self.cache_msgs.append(msg)
        self.cache_times.append(stamp)
        self.signalMessage(msg)

    def _pairs(self) -> list[tuple[Any, Any]]:
        return list(zip(self.cache_times, self.cache_msgs, strict=True))

    def getInterval(self, from_stamp: Any, to_stamp: Any) -> list[Any]:  # noqa: N802  # ROS 1's
        """Return the messages of a span of time, its ends included."""
        return [msg for stamp, msg in self._pairs() if from_stamp <= stamp <= to_stamp]

    def getElemAfterTime(self, stamp: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return the first message that is not older; None if all are."""
        return next((msg for when, msg in self._pairs() if when >= stamp), None)

    def getElemBeforeTime(self, stamp: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return the last message that is not newer; None if all are."""
        return next((msg for when, msg in reversed(self._pairs()) if when <= stamp), None)

    def getLatestTime(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the stamp of the message that came last; None if there is none."""
        return self.cache_times[-1] if self.cache_times else None

    def getOldestTime(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the stamp of the message that came first; None if there is none."""
        return self.cache_times[0] if self.cache_times else None

    def getLast(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the first message that is not older than the one that came last; None if empty."""
        return self.getElemAfterTime(self.cache_times[-1]) if self.cache_times else None
