"""Statistics of the transforms of each frame: who publishes it, how often and how late."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Iterable
from typing import Any

import msgspec

from rosz.node import Node
from rosz.transforms.buffer import Buffer
from rosz.transforms.topics import TransformListener

_SECOND = 1_000_000_000
_MOST = 1000
"""Newest transforms that delays and rates are calculated from."""
_PAUSE = 2.0
"""Seconds without a transform after which a publisher no longer gives a frame its parent."""


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
        other_parents: Other parents that it has at the same time, each with the full name of the
            node that publishes it; a frame should have none.
    """

    frame: str
    parent: str
    node: str
    static: bool
    rate: float
    mean_delay: float
    max_delay: float
    other_parents: dict[str, str] = {}


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


class FrameParents:
    """The parents that publishers give to frames, to find frames with several at a time.

    A frame may move from one parent to another, as what a gripper takes does.
    """

    def __init__(self) -> None:
        # The first and the last time of each parent and publisher of a frame.
        self._times: dict[str, dict[tuple[str, bytes], tuple[float, float]]] = {}

    def add(self, transform: Any, publisher: bytes, *, static: bool) -> None:
        """Add what has just arrived: a TransformStamped, and the GID of its publisher."""
        now = time.monotonic()
        times = self._times.setdefault(transform.child_frame_id.removeprefix("/"), {})
        own = transform.header.frame_id.removeprefix("/"), publisher
        for pair, (_, last) in list(times.items()):
            # A static transform takes the place of the publisher's earlier one.
            if last < now - _PAUSE or (static and pair[1] == publisher):
                del times[pair]
        first, _ = times.get(own, (now, now))
        times[own] = first, math.inf if static else now

    def several(self) -> dict[str, dict[str, bytes]]:
        """Return the frames with several parents now, each with the publishers of its parents."""
        earliest = time.monotonic() - _PAUSE
        parents: dict[str, dict[str, bytes]] = {}
        for frame, times in self._times.items():
            recent = [(pair, span) for pair, span in times.items() if span[1] >= earliest]
            for (parent, publisher), (first, last) in recent:
                if any(
                    other != parent and first <= ended and began <= last
                    for (other, _), (began, ended) in recent
                ):
                    parents.setdefault(frame, {})[parent] = publisher
        return parents


class Monitor:
    """Receive transforms, and measure their rates and delays.

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
        self._parents = FrameParents()
        self._listener = TransformListener(self.buffer, node, self._observe)

    def _observe(self, transforms: Iterable[Any], publisher: bytes, *, static: bool) -> None:
        now = self._node.now()
        delays: list[int] = []
        with self._lock:
            for transform in transforms:
                stamp = transform.header.stamp.sec * _SECOND + transform.header.stamp.nanosec
                delays.append(0 if static else now - stamp)
                times = self._frames.setdefault(
                    transform.child_frame_id.removeprefix("/"), _Times()
                )
                times.add(delays[-1], now)
                self._parents.add(transform, publisher, static=static)
            mean = sum(delays) // max(len(delays), 1)
            self._broadcasters.setdefault((publisher, static), _Times()).add(mean, now)

    def frames(self) -> list[FrameReport]:
        """Return the frames that have a parent, sorted by name."""
        histories = self.buffer.histories()
        with self._lock:
            several = self._parents.several()
            return [
                FrameReport(
                    name,
                    history.newest.parent,
                    history.authority,
                    history.static,
                    0.0 if history.static else history.rate,
                    self._frames[name].mean if name in self._frames else 0.0,
                    self._frames[name].most if name in self._frames else 0.0,
                    {
                        parent: self._listener.node_of(publisher)
                        for parent, publisher in several.get(name, {}).items()
                        if parent != history.newest.parent
                    },
                )
                for name, history in sorted(histories.items())
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
    """Return the lines of the tree of frames, each indented below its parent.

    A frame with several parents is below the one that came last, with the others beside its name.
    """
    marks: dict[str, str] = {}
    children: dict[str, list[str]] = {}
    named: set[str] = set()
    for report in frames:
        children.setdefault(report.parent, []).append(report.frame)
        named.add(report.frame)
        marks[report.frame] = describe_other_parents(report)
    lines: list[str] = []
    seen: set[str] = set()
    rest = [(root, 0) for root in sorted(children.keys() - named)]
    while rest:
        frame, depth = rest.pop(0)
        if frame in seen:
            continue
        seen.add(frame)
        lines.append(f"{'  ' * depth}{frame}{marks.get(frame, '')}")
        rest[:0] = [(child, depth + 1) for child in sorted(children.get(frame, ()))]
    lines += (f"{frame} (in a loop)" for frame in sorted(named - seen))
    return lines


def describe_other_parents(report: FrameReport) -> str:
    """Return the parents that a frame should not have besides the one that came last, or ""."""
    others = [
        f"{parent}{f' from {node}' if node else ''}"
        for parent, node in sorted(report.other_parents.items())
    ]
    return f" (two parents: also in {', '.join(others)})" if others else ""


def tree_as_dot(frames: Iterable[FrameReport], seconds: float) -> str:
    """Return the tree of frames in the language of Graphviz.

    Args:
        frames: The frames.
        seconds: Time for which transforms were received.
    """
    lines = ["digraph G {"]
    for report in frames:
        kind = "static" if report.static else f"{report.rate:.3f} Hz"
        label = (
            f"Broadcaster: {report.node or 'unknown'}\\n{kind}\\ndelay {report.mean_delay:.3f} s"
        )
        frame = _quoted(report.frame)
        lines.append(f'"{_quoted(report.parent)}" -> "{frame}" [label="{label}"];')
        for parent, node in sorted(report.other_parents.items()):
            label = f"Broadcaster: {node or 'unknown'}\\na second parent"
            lines.append(f'"{_quoted(parent)}" -> "{frame}" [label="{label}", color=red];')
    lines += [f'label="transforms of {seconds:g} s"; labelloc=t;', "}"]
    return "".join(f"{line}\n" for line in lines)


def _quoted(name: str) -> str:
    return name.replace("\\", "\\\\").replace('"', '\\"')
