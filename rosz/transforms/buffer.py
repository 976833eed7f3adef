"""The tree of coordinate frames over the last seconds."""

from __future__ import annotations

import itertools
import math
import threading
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Container, Iterator
from typing import NamedTuple

from rosz.errors import (
    ExtrapolationNeeded,
    FrameNotFound,
    FramesNotConnected,
    TimeMovedBackwards,
    TransformArgument,
    TransformError,
)
from rosz.node import Clock
from rosz.transforms.poses import Pose, Step, compose, compose_steps, invert

_SECOND = 1_000_000_000
_MAX_DEPTH = 1000
"""Largest depth of the tree, as in tf2; a deeper one must contain a loop."""

_LOOP = "The tf tree is invalid because it contains a loop."
_UNIT_TOLERANCE = 1e-3
_MOST_DROPPED = 64
"""Places that are too old, and are kept at least until they are removed together."""


class ParentPose(NamedTuple):
    """The pose of a frame in its parent."""

    parent: str
    pose: Pose


class History:
    """The places of a frame over time.

    Args:
        length_ns: Age in nanoseconds, relative to the newest place, up to which places are kept.
        static: Whether one place is valid at all times.
    """

    def __init__(self, length_ns: int, *, static: bool) -> None:
        self.static: bool = static
        self._authority: str | Callable[[], str] = ""
        self._length = length_ns
        self._first = 0  # those before it are too old
        self._stamps: list[int] = []
        self._places: list[ParentPose] = []

    @property
    def authority(self) -> str:
        """Source of the last place; empty if it is not known."""
        return self._authority() if callable(self._authority) else self._authority

    def add(self, stamp: int, place: ParentPose, authority: str | Callable[[], str]) -> bool:
        """Add a place; return whether it is new and not too old."""
        if not self._add(stamp, place):
            return False
        self._authority = authority
        return True

    def _add(self, stamp: int, place: ParentPose) -> bool:
        if self.static:
            self._stamps, self._places = [stamp], [place]
            return True
        stamps, places = self._stamps, self._places
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)
            places.append(place)
        else:
            index = bisect_left(stamps, stamp, self._first)
            if stamp < stamps[-1] - self._length or stamps[index] == stamp:
                return False
            stamps.insert(index, stamp)
            places.insert(index, place)
        self._first = first = bisect_left(stamps, stamps[-1] - self._length, self._first)
        if first > _MOST_DROPPED and first > len(stamps) // 32:  # each time would take too long
            del stamps[:first], places[:first]
            self._first = 0
        return True

    @property
    def latest(self) -> int:
        """Time of the newest place in nanoseconds; 0 for a static frame."""
        return 0 if self.static else self._stamps[-1]

    @property
    def oldest(self) -> int:
        """Time of the oldest place in nanoseconds; 0 for a static frame."""
        return 0 if self.static else self._stamps[self._first]

    @property
    def rate(self) -> float:
        """Places per second, as tf2 calculates it."""
        return (len(self._stamps) - self._first) / max((self.latest - self.oldest) / 1e9, 1e-4)

    @property
    def newest(self) -> ParentPose:
        """The newest place."""
        return self._places[-1]

    def at(self, stamp: int) -> tuple[str, Step] | None:
        """Return the parent at a time and the step to it; None if the time is not known."""
        places = self._places
        if self.static:
            parent, pose = places[0]
            return parent, (pose, pose, 0.0)
        stamps = self._stamps
        after = bisect_right(stamps, stamp, self._first)
        if after == self._first:
            return None
        before = after - 1
        began = stamps[before]
        parent, pose = places[before]
        if began == stamp:
            return parent, (pose, pose, 0.0)
        if after == len(stamps):
            return None
        parent_after, pose_after = places[after]
        if parent != parent_after:
            return parent, (pose, pose, 0.0)
        return parent, (pose, pose_after, (stamp - began) / (stamps[after] - began))

    def parent_at(self, stamp: int) -> str:
        """Return the parent at a time; empty if the time is not known."""
        places = self._places
        if self.static:
            return places[0][0]
        stamps = self._stamps
        after = bisect_right(stamps, stamp, self._first)
        if after == self._first or (after == len(stamps) and stamps[-1] != stamp):
            return ""
        return places[after - 1][0]

    def why_not(self, stamp: int) -> str:
        """Return why a time is not known."""
        first, last = self.oldest, self.latest
        if first == last:
            return (
                f"Lookup would require extrapolation at time {_seconds(stamp)}, but only time"
                f" {_seconds(first)} is in the buffer"
            )
        if stamp > last:
            return (
                f"Lookup would require extrapolation {_seconds(stamp - last)}s into the future. "
                f" Requested time {_seconds(stamp)} but the latest data is at time {_seconds(last)}"
            )
        return (
            f"Lookup would require extrapolation {_seconds(first - stamp)}s into the past. "
            f" Requested time {_seconds(stamp)} but the earliest data is at time {_seconds(first)}"
        )


def _seconds(nanoseconds: int) -> str:
    """Format nanoseconds as seconds with all digits."""
    return f"{nanoseconds // 10**9}.{nanoseconds % 10**9:09d}"


class Buffer:
    """A buffer of transforms, which calculates transforms between any frames. Thread-safe.

    Args:
        length_ns: Age in nanoseconds up to which transforms are kept.
    """

    def __init__(self, length_ns: int = 10 * _SECOND) -> None:
        self._length = length_ns
        self._frames: dict[str, History] = {}
        self._parents: set[str] = set()
        self._lock = threading.RLock()
        self._waiters: list[tuple[Callable[[], bool], Callable[[], object]]] = []

    def set(
        self,
        parent: str,
        child: str,
        stamp: int,
        pose: Pose,
        *,
        static: bool = False,
        authority: str | Callable[[], str] = "",
    ) -> bool:
        """Add the pose of a frame in its parent.

        Args:
            parent: Name of the parent; a leading slash is ignored.
            child: Name of the frame; a leading slash is ignored.
            stamp: Time in nanoseconds.
            pose: Pose of the frame, which transforms its coordinates into those of the parent.
            static: Whether the pose is valid at all times.
            authority: Source of the transform, or a function that returns it when it is asked for.

        Returns:
            Whether the transform is new and not too old.

        Raises:
            TransformArgument: A name is missing, both are the same, or the pose is not valid.
        """
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        _check(parent, child, pose)
        with self._lock:
            history = self._frames.get(child)
            if history is None or history.static != static:
                history = self._frames[child] = History(self._length, static=static)
            added = history.add(stamp, ParentPose(parent, pose), authority)
            if added:
                self._parents.add(parent)
                for condition, act in tuple(self._waiters):
                    if condition():
                        act()
            return added

    def clear(self) -> None:
        """Remove all transforms but the static ones."""
        with self._lock:
            self._frames = {
                name: history for name, history in self._frames.items() if history.static
            }
            self._parents = {history.newest.parent for history in self._frames.values()}

    def frames(self) -> list[str]:
        """Return the names of all frames, sorted."""
        with self._lock:
            return sorted(self._parents | self._frames.keys())

    def histories(self) -> dict[str, History]:
        """Return the history of each frame that has a parent, in the order of arrival."""
        with self._lock:
            return dict(self._frames)

    def has(self, frame: str) -> bool:
        """Return whether there is a frame of a name."""
        return frame in self._frames or frame in self._parents

    def lookup(self, target: str, source: str, stamp: int = 0) -> tuple[Pose, int]:
        """Return the transform from one frame to another.

        Args:
            target: Frame to transform coordinates to.
            source: Frame of the coordinates.
            stamp: Time in nanoseconds; 0 for the latest time at which all transforms are known.

        Returns:
            The pose of the source in the target, and its time.

        Raises:
            TransformArgument: A name is not valid.
            FrameNotFound: A frame does not exist.
            FramesNotConnected: The frames belong to separate trees.
            ExtrapolationNeeded: The time is before or after all known transforms.
        """
        up, down, stamp = self._find(target, source, stamp)
        pose = compose_steps(up)
        if down:
            outer = invert(compose_steps(down))
            pose = compose(outer, pose) if up else outer
        return pose, stamp

    def _find(
        self, target: str, source: str, stamp: int
    ) -> tuple[Collection[Step], Collection[Step], int]:
        """Return the steps to the common ancestor, from the source and the target, and the time."""
        with self._lock:
            self._check_frame(target, "target_frame")
            self._check_frame(source, "source_frame")
            if stamp == 0:
                stamp = self.latest_common(target, source)
            if target == source:
                return (), (), stamp
            return *self._way(target, source, stamp), stamp

    def lookup_full(
        self, target: str, target_stamp: int, source: str, source_stamp: int, fixed: str
    ) -> tuple[Pose, int]:
        """Return the transform from a frame at one time to a frame at another time.

        Args:
            target: Frame to transform coordinates to.
            target_stamp: Time of the target in nanoseconds.
            source: Frame of the coordinates.
            source_stamp: Time of the source in nanoseconds.
            fixed: Frame that does not move meanwhile.

        Raises:
            TransformError: As for `lookup`.
        """
        with self._lock:
            inner, _ = self.lookup(fixed, source, source_stamp)
            outer, stamp = self.lookup(target, fixed, target_stamp)
            return compose(outer, inner), stamp

    def latest_common(self, target: str, source: str) -> int:
        """Return the latest time at which a transform is known; 0 for a static one.

        Raises:
            FrameNotFound: A frame does not exist.
            FramesNotConnected: The frames belong to separate trees.
        """
        with self._lock:
            self._check_frame(target, "target_frame")
            self._check_frame(source, "source_frame")
            if target == source:
                history = self._frames.get(target)
                return 0 if history is None else history.latest
            # Each frame from the source upwards, with the latest time of the frames below it.
            below: dict[str, int] = {}
            for frame, latest in self._upwards(source):
                if frame == target:
                    return latest
                below[frame] = latest
            for frame, latest in self._upwards(target):
                if frame in below:
                    return min(filter(None, (latest, below[frame])), default=0)
            raise _unconnected(target, source)

    def why_not(self, target: str, source: str, stamp: int = 0) -> str:
        """Return why a transform is not known; empty if it is."""
        if stamp and self._is_known(target, source, stamp):
            return ""
        for name, role in ((target, "target_frame"), (source, "source_frame")):
            if not self.has(name):
                return f"canTransform: {role} {name} does not exist."
        try:
            self._find(target, source, stamp)
        except TransformError as error:
            return str(error)
        return ""

    def _is_known(self, target: str, source: str, stamp: int) -> bool:
        """Return whether a transform is known, if one of the frames is above the other."""
        with self._lock:
            frames = self._frames
            for end, top in ((source, target), (target, source)):
                frame = end
                for _ in range(_MAX_DEPTH):
                    history = frames.get(frame)
                    if history is None:
                        break
                    frame = history.parent_at(stamp)
                    if frame == top:
                        return True
        return False

    def chain(self, target: str, source: str) -> list[str]:
        """Return the frames between two frames, from the source to the target.

        Raises:
            FramesNotConnected: The frames belong to separate trees.
        """
        with self._lock:
            up = [frame for frame, _ in self._upwards(source)]
            down: list[str] = []
            for frame, _ in self._upwards(target):
                if frame in up:
                    return [*up[: up.index(frame) + 1], *reversed(down)]
                down.append(frame)
            raise _unconnected(target, source)

    def wait(self, known: Callable[[], bool], timeout_ns: int, clock: Clock) -> bool:
        """Wait for a condition, which is checked whenever a transform is added.

        Args:
            known: Condition.
            timeout_ns: Time limit in nanoseconds of the clock.
            clock: Clock to wait by; the wait ends when it is closed, or goes back.

        Returns:
            Whether the condition was met.
        """
        alarm = clock.branch()
        forget = self.when(known, alarm.close)
        try:
            alarm.sleep(timeout_ns)
        except TimeMovedBackwards:
            pass
        finally:
            forget()
        return known()

    def when(self, known: Callable[[], bool], act: Callable[[], object]) -> Callable[[], object]:
        """Call a function if a condition is met, now and whenever a transform is added.

        Returns:
            A function that ends this.
        """
        waiter = known, act
        with self._lock:
            self._waiters.append(waiter)
            if known():
                act()
        return lambda: self._waiters.remove(waiter)

    def _check_frame(self, name: str, role: str) -> None:
        if not name:
            raise TransformArgument(
                f"Invalid argument passed to lookupTransform argument {role} in tf2 frame_ids"
                " cannot be empty"
            )
        if name.startswith("/"):
            raise TransformArgument(
                f'Invalid argument "{name}" passed to lookupTransform argument {role} in tf2'
                " frame_ids cannot start with a '/' like: "
            )
        if not self.has(name):
            raise FrameNotFound(
                f'"{name}" passed to lookupTransform argument {role} does not exist. '
            )

    def _upwards(self, frame: str) -> Iterator[tuple[str, int]]:
        """Yield the frames from a frame up to the root, each with the latest known time.

        That is the latest one at which the pose of the first frame in it is known; 0 for any time.
        """
        frames, latest = self._frames, 0
        for _ in range(_MAX_DEPTH):
            yield frame, latest
            history = frames.get(frame)
            if history is None:
                return
            newest = history.latest
            if newest and (newest < latest or not latest):
                latest = newest
            frame = history.newest.parent
        raise TransformError(_LOOP)

    def _climb(
        self, frame: str, stamp: int, ends: Container[str]
    ) -> tuple[dict[str, Step], str, str]:
        """Go up from a frame to the first of some others, or to the root.

        Returns:
            The step of each frame on the way to its parent, the frame at which the way ends, and
            why it ends there if it is neither.
        """
        frames = self._frames
        steps: dict[str, Step] = {}
        for _ in range(_MAX_DEPTH):
            history = frames.get(frame)
            if history is None or frame in ends:
                return steps, frame, ""
            place = history.at(stamp)
            if place is None:
                return steps, frame, history.why_not(stamp)
            parent, steps[frame] = place
            frame = parent
        raise TransformError(_LOOP)

    def _way(
        self, target: str, source: str, stamp: int
    ) -> tuple[Collection[Step], Collection[Step]]:
        """Return the steps from the source, and from the target, to their common ancestor."""
        up, top, beyond = self._climb(source, stamp, (target,))
        if top == target:
            return up.values(), ()
        passed = {*up, top}
        down, shared, why = self._climb(target, stamp, passed)
        if shared in passed:
            way = itertools.takewhile(lambda step: step[0] != shared, up.items())
            return [step for _, step in way], down.values()
        beyond = why or beyond  # the last one counts, as in tf2
        if beyond:
            raise ExtrapolationNeeded(
                f"{beyond}, when looking up transform from frame [{source}] to frame [{target}]"
            )
        raise _unconnected(target, source)


def _unconnected(target: str, source: str) -> FramesNotConnected:
    return FramesNotConnected(
        f"Could not find a connection between '{target}' and '{source}' because they are not"
        " part of the same tree.Tf has two or more unconnected trees."
    )


def _check(parent: str, child: str, pose: Pose) -> None:
    if not child:
        raise TransformArgument("a transform without a child_frame_id is ignored")
    if not parent:
        raise TransformArgument(f"the transform of '{child}' has no frame_id, and is ignored")
    if parent == child:
        raise TransformArgument(f"the transform of '{child}' to itself is ignored")
    (px, py, pz), (x, y, z, w) = pose
    square = x * x + y * y + z * z + w * w
    unit = abs(square - 1.0) <= _UNIT_TOLERANCE * 2
    if unit and math.isfinite(px + py + pz):  # which is fast, and nearly always so
        return
    numbers = (*pose.translation, *pose.rotation)
    if not all(math.isfinite(number) for number in numbers):
        raise TransformArgument(
            f"the transform of '{child}' has a number that is not finite: {numbers}"
        )
    if not unit:
        raise TransformArgument(
            f"the transform of '{child}' has a rotation of length {math.sqrt(square):g}; expected 1"
        )
