"""The tree of frames, over the last seconds."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator

from rosz.errors import (
    ExtrapolationNeeded,
    FrameNotFound,
    FramesNotConnected,
    TransformArgument,
    TransformError,
)
from rosz.transforms.history import History, Place
from rosz.transforms.poses import IDENTITY, Pose, compose, invert

__all__ = ("Buffer",)

_SECOND = 1_000_000_000
_DEEPEST = 1000
"""Frames on the way up to the root beyond which there must be a ring."""

_UNIT_WITHIN = 1e-3
_LOOK_SECONDS = 0.05


class Buffer:
    """Transforms that were told, and those that follow from them. Safe for threads.

    Args:
        length_ns: Nanoseconds for which transforms are kept.
    """

    def __init__(self, length_ns: int = 10 * _SECOND) -> None:
        self._length = length_ns
        self._frames: dict[str, History] = {}
        self._parents: set[str] = set()
        self._changed = threading.Condition(threading.RLock())

    def set(
        self,
        parent: str,
        child: str,
        stamp: int,
        pose: Pose,
        *,
        static: bool = False,
        authority: str = "",
    ) -> bool:
        """Take note of where a frame is in its parent.

        Args:
            parent: Name of the parent; a slash in front does not count.
            child: Name of the frame; a slash in front does not count.
            stamp: When, in nanoseconds.
            pose: Where: what brings coordinates of the frame into the parent.
            static: Whether it holds for all times.
            authority: Who tells.

        Returns:
            Whether it was news, and not too old.

        Raises:
            TransformArgument: A name is missing, both are one, or the pose is none.
        """
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        _check(parent, child, pose)
        with self._changed:
            history = self._frames.get(child)
            if history is None or history.static != static:
                history = self._frames[child] = History(self._length, static=static)
            news = history.add(stamp, Place(parent, pose))
            if news:
                history.authority = authority
                self._parents.add(parent)
                self._changed.notify_all()
            return news

    def clear(self) -> None:
        """Forget everything but what holds for all times."""
        with self._changed:
            self._frames = {name: one for name, one in self._frames.items() if one.static}
            self._parents = {one.newest.parent for one in self._frames.values()}

    def frames(self) -> list[str]:
        """Return the names of all frames, sorted."""
        with self._changed:
            return sorted(self._parents | self._frames.keys())

    def histories(self) -> dict[str, History]:
        """Return what is known of each frame that has a parent, in the order they were told."""
        with self._changed:
            return dict(self._frames)

    def has(self, frame: str) -> bool:
        """Tell whether there is a frame of that name."""
        return frame in self._frames or frame in self._parents

    def lookup(self, target: str, source: str, stamp: int = 0) -> tuple[Pose, int]:
        """Return what brings coordinates of one frame into another.

        Args:
            target: The frame that coordinates are wanted in.
            source: The frame that they are in.
            stamp: When, in nanoseconds; 0 for the latest time at which all is known.

        Returns:
            The pose of the source in the target, and when that is.

        Raises:
            TransformArgument: A name is none.
            FrameNotFound: There is no such frame.
            FramesNotConnected: They belong to separate trees.
            ExtrapolationNeeded: The time is before or after what is known.
        """
        with self._changed:
            for name, role in ((target, "target_frame"), (source, "source_frame")):
                self._check_frame(name, role)
            if stamp == 0:
                stamp = self.latest_common(target, source)
            if target == source:
                return IDENTITY, stamp
            return self._walk(target, source, stamp), stamp

    def lookup_full(
        self, target: str, target_stamp: int, source: str, source_stamp: int, fixed: str
    ) -> tuple[Pose, int]:
        """Return what brings coordinates of one time into another frame at another time.

        Args:
            target: The frame that coordinates are wanted in.
            target_stamp: When, in nanoseconds.
            source: The frame that they are in.
            source_stamp: When they were there.
            fixed: A frame that does not move meanwhile.

        Raises:
            TransformError: As `lookup`.
        """
        with self._changed:
            inner, _ = self.lookup(fixed, source, source_stamp)
            outer, stamp = self.lookup(target, fixed, target_stamp)
            return compose(outer, inner), stamp

    def latest_common(self, target: str, source: str) -> int:
        """Return the latest time at which a transform is known; 0 if it holds for all times.

        Raises:
            FrameNotFound: There is no such frame.
            FramesNotConnected: They belong to separate trees.
        """
        with self._changed:
            for name, role in ((target, "target_frame"), (source, "source_frame")):
                self._check_frame(name, role)
            if target == source:
                history = self._frames.get(target)
                return 0 if history is None else history.latest
            up = list(self._upwards(source))
            above = {frame: number for number, (frame, _) in enumerate(up)}
            stamps: list[int] = []
            for frame, latest in self._upwards(target):
                if frame in above:
                    stamps += [stamp for _, stamp in up[: above[frame]]]
                    return min((stamp for stamp in stamps if stamp), default=0)
                stamps.append(latest)
            raise self._unconnected(target, source)

    def why_not(self, target: str, source: str, stamp: int = 0) -> str:
        """Return why a transform is not known; empty if it is."""
        for name, role in ((target, "target_frame"), (source, "source_frame")):
            if not self.has(name):
                return f"canTransform: {role} {name} does not exist."
        try:
            self.lookup(target, source, stamp)
        except TransformError as error:
            return str(error)
        return ""

    def wait(self, known: Callable[[], bool], timeout_ns: int, now: Callable[[], int]) -> bool:
        """Wait until something is known.

        Args:
            known: Tells whether it is.
            timeout_ns: Nanoseconds to wait at most, by the clock given.
            now: Tells the time in nanoseconds.

        Returns:
            Whether it is known.
        """
        began = now()
        with self._changed:
            while not known():
                passed = now() - began
                if passed >= timeout_ns or passed < 0:
                    return False
                left = (timeout_ns - passed) / _SECOND
                self._changed.wait(min(left, _LOOK_SECONDS))
        return True

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
        """Yield the frames from one to the root, each with its latest time; the root with 0."""
        for _ in range(_DEEPEST):
            history = self._frames.get(frame)
            if history is None:
                yield frame, 0
                return
            yield frame, history.latest
            frame = history.newest.parent
        raise self._ring()

    def _walk(self, target: str, source: str, stamp: int) -> Pose:
        """Go up from both frames to where their ways meet."""
        below: dict[str, Pose] = {}
        beyond = ""
        for way, start, end in ((0, source, target), (1, target, source)):
            frame, pose = start, IDENTITY
            for _ in range(_DEEPEST):
                if way and frame in below:
                    return compose(invert(pose), below[frame])
                if not way:
                    below[frame] = pose
                    if frame == end:
                        return pose
                history = self._frames.get(frame)
                if history is None:
                    break
                try:
                    place = history.at(stamp)
                except ExtrapolationNeeded as error:
                    beyond = str(error)  # the last one counts, as in tf2
                    break
                pose = compose(place.pose, pose)
                frame = place.parent
            else:
                raise self._ring()
        if beyond:
            raise ExtrapolationNeeded(
                f"{beyond}, when looking up transform from frame [{source}] to frame [{target}]"
            )
        raise self._unconnected(target, source)

    def _unconnected(self, target: str, source: str) -> FramesNotConnected:
        return FramesNotConnected(
            f"Could not find a connection between '{target}' and '{source}' because they are not"
            " part of the same tree.Tf has two or more unconnected trees."
        )

    def _ring(self) -> TransformError:
        return TransformError("The tf tree is invalid because it contains a loop.")


def _check(parent: str, child: str, pose: Pose) -> None:
    if not child:
        raise TransformArgument("a transform without a child_frame_id is ignored")
    if not parent:
        raise TransformArgument(f"the transform of '{child}' has no frame_id, and is ignored")
    if parent == child:
        raise TransformArgument(f"the transform of '{child}' to itself is ignored")
    numbers = (*pose.translation, *pose.rotation)
    if not all(math.isfinite(number) for number in numbers):
        raise TransformArgument(f"the transform of '{child}' has a number that is none: {numbers}")
    square = sum(part * part for part in pose.rotation)
    if abs(square - 1.0) > _UNIT_WITHIN * 2:
        raise TransformArgument(
            f"the transform of '{child}' has a rotation of length {math.sqrt(square):g}; expected 1"
        )
