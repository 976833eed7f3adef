"""Fields of messages over time, while a page plots them; bounded in points."""

from __future__ import annotations

import itertools
import math
import threading
import time
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from typing import Any

from rosz.errors import RoszError, UsageError
from rosz.introspect import FieldPath, Survey, find_target, topic_types
from rosz.message import slot_type, slots
from rosz.node import Node
from rosz.time import DurationValue, TimeValue

_MOST_POINTS = 60_000
_SPARE_POINTS = 6_000
"""Points that are kept beyond that, so that the oldest are forgotten many at a time."""
_DEEPEST = 6
_MOST_FIELDS = 200
_MOST_ELEMENTS = 50
_QUEUE = 200


def split_fields(text: str) -> list[str]:
    """Return the fields that a text names; ``/pose/x:y`` stands for two, as in rqt_plot."""
    words = text.replace(",", " ").split()
    return list(dict.fromkeys(field for word in words for field in FieldPath.spell_out(word)))


class Series:
    """The newest points of one field; safe to use from several threads."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._lock = threading.Lock()
        self._times: list[float] = []
        self._values: list[float] = []

    @property
    def newest(self) -> float:
        """Time of the newest point in seconds since the Unix epoch; 0 without one."""
        times = self._times
        return times[-1] if times else 0.0

    def add(self, moment: float, value: float) -> None:
        """Add a point at a time in seconds; one that is older begins the series again."""
        with self._lock:
            if self._times and moment < self._times[-1]:
                self._times.clear()
                self._values.clear()
            self._times.append(moment)
            self._values.append(value)
            if len(self._times) > _MOST_POINTS + _SPARE_POINTS:
                del self._times[:_SPARE_POINTS]
                del self._values[:_SPARE_POINTS]

    def points(self, begin: float = 0.0, end: float = math.inf) -> tuple[list[float], list[float]]:
        """Return times and values of all points from one time to another."""
        with self._lock:
            first, last = bisect_left(self._times, begin), bisect_right(self._times, end)
            return self._times[first:last], self._values[first:last]

    def within(self, begin: float, end: float, most: int) -> list[tuple[float, float]]:
        """Return points from one time to another; of many, the lowest and highest of each part."""
        times, values = self.points(begin, end)
        if len(times) <= most:
            return list(zip(times, values, strict=True))
        size = -(-len(times) * 2 // most)
        return [
            (times[index], values[index])
            for start in range(0, len(times), size)
            for index in _extremes(values, start, start + size)
        ]


def _extremes(values: list[float], start: int, end: int) -> list[int]:
    part = values[start:end]
    return sorted({start + part.index(min(part)), start + part.index(max(part))})


def plottable_fields(cls: type[Any], depth: int = 0) -> Iterator[str]:
    """Yield the fields of a class that can be plotted, such as ``pose/x``, at a depth."""
    for slot in slots(cls):
        kind = slot_type(slot).partition("[")[0]
        if "/" not in kind:
            if not kind.startswith(("string", "wstring")):
                yield slot.name
        elif depth < _DEEPEST and not isinstance(slot.kind, str):
            index = "" if slot.shape == "one" else "[0]"
            for name in plottable_fields(slot.kind, depth + 1):
                yield f"{slot.name}{index}/{name}"


class _Feed:
    """The subscription of one topic, and the fields that are plotted of it."""

    def __init__(self, node: Node, topic: str, type_name: str, *, stamped: bool) -> None:
        self.paths: dict[str, FieldPath] = {}
        self.series: dict[str, Series] = {}
        cls = node.context.types.message(type_name)
        self._stamped = stamped and cls._has_header
        self._subscription = node.subscription(topic, cls, self._receive, queue_size=_QUEUE)

    def _receive(self, message: Any) -> None:
        now = message.header.stamp.to_sec() if self._stamped else time.time()
        for name, path in list(self.paths.items()):
            try:
                value = path.read(message)
            except LookupError:  # this message has fewer elements
                continue
            for key, number in _numbers(name, value):
                series = self.series.get(key)
                if series is None:
                    series = self.series[key] = Series(key)
                series.add(now, number)

    def close(self) -> None:
        self._subscription.close()


def _numbers(name: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float):
        yield name, float(value)
    elif isinstance(value, TimeValue | DurationValue):
        yield name, value.to_sec()
    elif isinstance(value, list | tuple | array | bytes):
        for number, item in enumerate(value[:_MOST_ELEMENTS]):
            yield from _numbers(f"{name}[{number}]", item)


class Plot:
    """The fields that a page plots, until it is closed.

    Args:
        node: The node that subscribes to their topics.
        stamped: Whether the time of a point is that in the header of its message, where there is
            one, and not that of its arrival.
    """

    def __init__(self, node: Node, *, stamped: bool = False) -> None:
        self._node = node
        self._stamped = stamped
        self._lock = threading.Lock()
        self._feeds: dict[str, _Feed] = {}
        self._topics: dict[str, str] = {}

    @property
    def fields(self) -> list[str]:
        """The fields, in the order in which they were added."""
        return list(self._topics)

    def add(self, survey: Survey, name: str) -> None:
        """Plot a field, such as ``/turtle1/pose/x``.

        Raises:
            NotFoundError: The topic or the field does not exist.
            UsageError: The path is malformed, or is not of numbers.
        """
        if name in self._topics:
            return
        load = self._node.context.types.message
        target = find_target(name, topic_types(survey.view), load)
        kind = target.path.type_in(load(target.type_name))
        if "/" in kind.partition("[")[0] or kind.startswith(("string", "wstring")):
            raise UsageError(f"'{name}' is a {kind}: only numbers are plotted; name a field of it")
        with self._lock:
            feed = self._feeds.get(target.topic)
            if feed is None:
                feed = self._feeds[target.topic] = _Feed(
                    self._node, target.topic, target.type_name, stamped=self._stamped
                )
            feed.paths[name] = target.path
            self._topics[name] = target.topic

    def offered(self, survey: Survey) -> dict[str, list[str]]:
        """Return the fields that can be plotted, by topic; topics of unknown types have none."""
        by_topic: dict[str, list[str]] = {}
        for topic, types in topic_types(survey.view).items():
            try:
                cls = self._node.context.types.message(types[0])
            except RoszError:
                continue
            if fields := list(itertools.islice(plottable_fields(cls), _MOST_FIELDS)):
                by_topic[topic] = fields
        return dict(sorted(by_topic.items()))

    def remove(self, name: str) -> None:
        """Plot a field no longer."""
        with self._lock:
            topic = self._topics.pop(name, "")
            feed = self._feeds.get(topic)
            if feed is None:
                return
            feed.paths.pop(name, None)
            for key in list(feed.series):
                if key == name or key.startswith(f"{name}["):
                    del feed.series[key]
            if not feed.paths:
                del self._feeds[topic]
                feed.close()

    def series(self) -> list[Series]:
        """Return all series, sorted by name."""
        with self._lock:
            feeds = list(self._feeds.values())
        return sorted(
            (line for feed in feeds for line in feed.series.copy().values()),
            key=lambda line: line.name,
        )

    def table(self) -> str:
        """Return all points as CSV: time, field, value."""
        lines = ["time,field,value"]
        for line in self.series():
            times, values = line.points()
            lines += [f"{t:.6f},{line.name},{v!r}" for t, v in zip(times, values, strict=True)]
        return "\n".join([*lines, ""])

    def close(self) -> None:
        """Plot nothing any more."""
        for name in self.fields:
            self.remove(name)
