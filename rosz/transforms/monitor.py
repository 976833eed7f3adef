"""Statistics of the transforms of each frame: who publishes it, how often and how late."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable
from typing import Any

import msgspec

from rosz.node import Node
from rosz.transforms.buffer import Buffer
from rosz.transforms.topics import TransformListener

__all__ = ("BroadcasterReport", "FrameReport", "Monitor", "tree_as_dot", "tree_as_text")

_SECOND = 1_000_000_000
_MOST = 1000
"""Newest transforms that delays and rates are calculated from."""


class FrameReport(msgspec.Struct, frozen=True):
    """A frame that has a parent.

    Attributes:
        frame: Name of the frame.
        parent: Name of its parent.
        node: Full name of the node that published it last; empty if unknown.
        static: Whether it does not move.
        rate: Transforms per second of those in the buffer; 0 for a static frame.
        mean_delay: Mean time from the stamp to the arrival of a transform, in seconds.
        max_delay: Largest such time, in seconds.
    """

    frame: str
    parent: str
    node: str
    static: bool
    rate: float
    mean_delay: float
    max_delay: float


class BroadcasterReport(msgspec.Struct, frozen=True):
    """A node that publishes transforms.

    Attributes:
        node: Full name of the node; static transforms are counted apart.
        rate: Messages per second.
        mean_delay: Mean delay of its messages, in seconds.
        max_delay: Largest delay, in seconds.
    """

    node: str
    rate: float
    mean_delay: float
    max_delay: float


class _Times:
    """Delays and arrivals, both in nanoseconds."""

    def __init__(self) -> None:
        self.delays: deque[int] = deque(maxlen=_MOST)
        self.arrivals: deque[int] = deque(maxlen=_MOST)

    def add(self, delay: int, arrival: int) -> None:
        self.delays.append(delay)
        self.arrivals.append(arrival)

    @property
    def mean(self) -> float:
        return sum(self.delays) / len(self.delays) / _SECOND if self.delays else 0.0

    @property
    def most(self) -> float:
        return max(0, *self.delays) / _SECOND if self.delays else 0.0

    @property
    def rate(self) -> float:
        if len(self.arrivals) < 2:  # noqa: PLR2004  # two arrivals are one period
            return 0.0
        passed = self.arrivals[-1] - self.arrivals[0]
        return (len(self.arrivals) - 1) * _SECOND / passed if passed > 0 else 0.0


class Monitor:
    """Receive transforms, and keep account of what arrives.

    Args:
        node: Node of the subscriptions.

    Attributes:
        buffer: The transforms.
    """

    def __init__(self, node: Node) -> None:
        self.buffer: Buffer = Buffer()
        self._node = node
        self._lock = threading.Lock()
        self._frames: dict[str, _Times] = {}
        self._broadcasters: dict[tuple[bytes, bool], _Times] = {}
        self._listener = TransformListener(self.buffer, node, self._observe)

    def _observe(self, transforms: Iterable[Any], publisher: bytes, *, static: bool) -> None:
        now = self._node.now()
        delays: list[int] = []
        with self._lock:
            for one in transforms:
                stamp = one.header.stamp.sec * _SECOND + one.header.stamp.nanosec
                delays.append(0 if static else now - stamp)
                times = self._frames.setdefault(one.child_frame_id.removeprefix("/"), _Times())
                times.add(delays[-1], now)
            mean = sum(delays) // max(len(delays), 1)
            self._broadcasters.setdefault((publisher, static), _Times()).add(mean, now)

    def frames(self) -> list[FrameReport]:
        """Return the frames that have a parent, sorted by name."""
        found = self.buffer.histories()
        with self._lock:
            return [
                FrameReport(
                    name,
                    one.newest.parent,
                    one.authority,
                    one.static,
                    0.0 if one.static else one.rate,
                    self._frames[name].mean if name in self._frames else 0.0,
                    self._frames[name].most if name in self._frames else 0.0,
                )
                for name, one in sorted(found.items())
            ]

    def broadcasters(self) -> list[BroadcasterReport]:
        """Return the nodes that publish transforms, sorted by name."""
        with self._lock:
            named = {  # of a node that came again, the newest publisher
                self._listener.node_of(publisher) + ("(static)" if static else ""): times
                for (publisher, static), times in self._broadcasters.items()
            }
            return [
                BroadcasterReport(node, times.rate, times.mean, times.most)
                for node, times in sorted(named.items())
            ]

    def close(self) -> None:
        """Stop receiving."""
        self._listener.close()


def tree_as_text(frames: Iterable[FrameReport]) -> list[str]:
    """Return the lines of the tree of frames, each indented below its parent."""
    children: dict[str, list[str]] = {}
    known: set[str] = set()
    for one in frames:
        children.setdefault(one.parent, []).append(one.frame)
        known.add(one.frame)
    lines: list[str] = []
    seen: set[str] = set()
    rest = [(root, 0) for root in sorted(children.keys() - known)]
    while rest:
        frame, depth = rest.pop(0)
        if frame in seen:
            continue
        seen.add(frame)
        lines.append(f"{'  ' * depth}{frame}")
        rest[:0] = [(child, depth + 1) for child in sorted(children.get(frame, ()))]
    lines += (f"{frame} (in a loop)" for frame in sorted(known - seen))
    return lines


def tree_as_dot(frames: Iterable[FrameReport], seconds: float) -> str:
    """Return the tree of frames in the language of Graphviz.

    Args:
        frames: The frames.
        seconds: Time for which transforms were received.
    """
    lines = ["digraph G {"]
    for one in frames:
        kind = "static" if one.static else f"{one.rate:.3f} Hz"
        label = f"Broadcaster: {one.node or 'unknown'}\\n{kind}\\ndelay {one.mean_delay:.3f} s"
        lines.append(f'"{_quoted(one.parent)}" -> "{_quoted(one.frame)}" [label="{label}"];')
    lines += [f'label="transforms of {seconds:g} s"; labelloc=t;', "}"]
    return "".join(f"{line}\n" for line in lines)


def _quoted(name: str) -> str:
    return name.replace("\\", "\\\\").replace('"', '\\"')
