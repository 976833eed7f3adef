"""What is known of one frame: where it was in its parent, and when."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import NamedTuple

from rosz.errors import ExtrapolationNeeded
from rosz.transforms.poses import Pose, interpolate

__all__ = ("History", "Place", "seconds")


class Place(NamedTuple):
    """Where a frame is in its parent."""

    parent: str
    pose: Pose


class History:
    """Places of a frame by time.

    Args:
        length_ns: Nanoseconds, before the newest, for which places are kept.
        static: Whether one place holds for all times.

    Attributes:
        static: As given.
        authority: Who told of the frame last.
    """

    def __init__(self, length_ns: int, *, static: bool) -> None:
        self.static = static
        self.authority = ""
        self._length = length_ns
        self._stamps: list[int] = []
        self._places: list[Place] = []

    def add(self, stamp: int, place: Place) -> bool:
        """Take note of a place; tell whether it was news, and not too old."""
        if self.static:
            self._stamps, self._places = [stamp], [place]
            return True
        if self._stamps and stamp < self._stamps[-1] - self._length:
            return False
        index = bisect_left(self._stamps, stamp)
        if index < len(self._stamps) and self._stamps[index] == stamp:
            return False
        self._stamps.insert(index, stamp)
        self._places.insert(index, place)
        old = bisect_left(self._stamps, self._stamps[-1] - self._length)
        del self._stamps[:old], self._places[:old]
        return True

    @property
    def latest(self) -> int:
        """Nanoseconds of the newest place; 0 where it holds for all times."""
        return 0 if self.static else self._stamps[-1]

    @property
    def oldest(self) -> int:
        """Nanoseconds of the oldest place; 0 where it holds for all times."""
        return 0 if self.static else self._stamps[0]

    def __len__(self) -> int:
        return len(self._stamps)

    @property
    def newest(self) -> Place:
        """The newest place."""
        return self._places[-1]

    def at(self, stamp: int) -> Place:
        """Return the place at a time, between two that are known if need be.

        Raises:
            ExtrapolationNeeded: It is before or after all that is known.
        """
        if self.static:
            return self._places[0]
        after = bisect_right(self._stamps, stamp)
        if after and self._stamps[after - 1] == stamp:
            return self._places[after - 1]
        if after in {0, len(self._stamps)}:
            raise ExtrapolationNeeded(self._beyond(stamp))
        before = after - 1
        one, two = self._places[before], self._places[after]
        if one.parent != two.parent:
            return one
        began, ended = self._stamps[before], self._stamps[after]
        return Place(one.parent, interpolate(one.pose, two.pose, (stamp - began) / (ended - began)))

    def _beyond(self, stamp: int) -> str:
        first, last = self._stamps[0], self._stamps[-1]
        if first == last:
            return (
                f"Lookup would require extrapolation at time {seconds(stamp)}, but only time"
                f" {seconds(first)} is in the buffer"
            )
        if stamp > last:
            return (
                f"Lookup would require extrapolation {seconds(stamp - last)}s into the future. "
                f" Requested time {seconds(stamp)} but the latest data is at time {seconds(last)}"
            )
        return (
            f"Lookup would require extrapolation {seconds(first - stamp)}s into the past. "
            f" Requested time {seconds(stamp)} but the earliest data is at time {seconds(first)}"
        )


def seconds(nanoseconds: int) -> str:
    """Return nanoseconds as seconds with all digits."""
    return f"{nanoseconds // 10**9}.{nanoseconds % 10**9:09d}"
