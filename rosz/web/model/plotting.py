"""Fields of messages over time, while a page plots them; bounded in points."""

from __future__ import annotations

import threading
import time
from array import array
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import UsageError
from rosz.introspect.fields import FieldPath, find_target
from rosz.introspect.subscribe import topic_types
from rosz.time import DurationValue, TimeValue

if TYPE_CHECKING:
    from rosz.introspect.survey import Survey
    from rosz.node import Node

__all__ = ("Plot", "Series", "split_fields")

_MOST_POINTS = 60_000
_MOST_ELEMENTS = 50
_QUEUE = 200


def split_fields(text: str) -> list[str]:
    """Return the fields that a text names; ``/pose/x:y`` stands for two, as in rqt_plot."""
    found: list[str] = []
    for word in text.replace(",", " ").split():
        first, *others = _parts(word)
        found.append(first)
        found += [f"{first.rpartition('/')[0]}/{one}" for one in others]
    return list(dict.fromkeys(found))


def _parts(word: str) -> list[str]:
    """Split at colons that are not in an index."""
    parts, depth = [""], 0
    for letter in word:
        depth += (letter == "[") - (letter == "]")
        if letter == ":" and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [one for one in parts if one] or [word]


class Series(msgspec.Struct):
    """The points of one field.

    Attributes:
        name: The field, with its topic.
        times: Times of arrival, in seconds since the Unix epoch.
        values: The values.
    """

    name: str
    times: deque[float]
    values: deque[float]

    def since(self, begin: float, most: int) -> list[tuple[float, float]]:
        """Return the points from a time on; of many, the lowest and highest of each part.

        Args:
            begin: Time in seconds since the Unix epoch.
            most: Largest number of points.
        """
        points = [
            (t, v)
            for t, v in zip(self.times.copy(), self.values.copy(), strict=False)
            if t >= begin
        ]
        if len(points) <= most:
            return points
        size = -(-len(points) * 2 // most)
        return [
            one
            for start in range(0, len(points), size)
            for one in _extremes(points[start : start + size])
        ]


def _extremes(points: list[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    low = min(points, key=lambda point: point[1])
    high = max(points, key=lambda point: point[1])
    yield from sorted({low, high})


class _Feed:
    """The subscription of one topic, and the fields that are plotted of it."""

    def __init__(self, node: Node, topic: str, type_name: str) -> None:
        self.paths: dict[str, FieldPath] = {}
        self.series: dict[str, Series] = {}
        cls = node.context.types.message(type_name)
        self._subscription = node.subscription(topic, cls, self._receive, queue_size=_QUEUE)

    def _receive(self, message: Any) -> None:
        now = time.time()
        for name, path in list(self.paths.items()):
            try:
                value = path.read(message)
            except LookupError:  # this message has fewer elements
                continue
            for key, number in _numbers(name, value):
                series = self.series.get(key)
                if series is None:
                    series = self.series[key] = Series(
                        key, deque(maxlen=_MOST_POINTS), deque(maxlen=_MOST_POINTS)
                    )
                series.times.append(now)
                series.values.append(number)

    def close(self) -> None:
        self._subscription.close()


def _numbers(name: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float):
        yield name, float(value)
    elif isinstance(value, TimeValue | DurationValue):
        yield name, value.to_sec()
    elif isinstance(value, list | tuple | array | bytes):
        for number, one in enumerate(value[:_MOST_ELEMENTS]):
            yield from _numbers(f"{name}[{number}]", one)


class Plot:
    """The fields that a page plots, until it is closed.

    Args:
        node: The node that subscribes to their topics.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
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
            NotFoundError: There is no such topic, or it has no such field.
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
                feed = self._feeds[target.topic] = _Feed(self._node, target.topic, target.type_name)
            feed.paths[name] = target.path
            self._topics[name] = target.topic

    def remove(self, name: str) -> None:
        """Plot a field no longer."""
        with self._lock:
            topic = self._topics.pop(name, "")
            feed = self._feeds.get(topic)
            if feed is None:
                return
            feed.paths.pop(name, None)
            for key in [one for one in feed.series if one == name or one.startswith(f"{name}[")]:
                del feed.series[key]
            if not feed.paths:
                del self._feeds[topic]
                feed.close()

    def series(self) -> list[Series]:
        """Return all series, sorted by name."""
        with self._lock:
            feeds = list(self._feeds.values())
        return sorted(
            (one for feed in feeds for one in feed.series.copy().values()), key=lambda one: one.name
        )

    def table(self) -> str:
        """Return all points as CSV: time, field, value."""
        lines = ["time,field,value"]
        for one in self.series():
            points = zip(one.times.copy(), one.values.copy(), strict=False)
            lines += [f"{t:.6f},{one.name},{v!r}" for t, v in points]
        return "\n".join([*lines, ""])

    def close(self) -> None:
        """Plot nothing any more."""
        for name in self.fields:
            self.remove(name)
