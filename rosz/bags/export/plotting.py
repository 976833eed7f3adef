"""Numbers in bags as curves over time. Drawing needs the extra ``rosz[plot]``."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from rosz import names
from rosz.bags.bag import Channel, Entry, FileErrors
from rosz.errors import NotFoundError, UsageError
from rosz.introspect import FieldPath, Loader, find_target
from rosz.message import SCALAR_CODES, Message, slots
from rosz.time import DurationValue, TimeValue

FORMATS = (".png", ".svg", ".pdf")
_NS = 1_000_000_000
_NUMBERS = frozenset({*SCALAR_CODES, "time", "duration"})
_MOST_LINES = 32
_WIDTH, _HEIGHT = 10.0, 3.2


class Curve(msgspec.Struct):
    """The values of a field, or of its elements.

    Attributes:
        lines: Times in seconds and values: by element as ``" 0"``, or ``""`` for a single number.
        missing: Number of messages that have no such element.
    """

    topic: str
    path: FieldPath
    lines: dict[str, tuple[array[float], array[float]]] = msgspec.field(default_factory=dict)
    missing: int = 0

    @property
    def label(self) -> str:
        """The field as a person names it."""
        return f"{self.topic}/{self.path.text}"

    def add(self, time: float, message: Message) -> None:
        """Add the value of a message; raise `UsageError` if it has more than 32 elements."""
        try:
            value = self.path.read(message)
        except LookupError:
            self.missing += 1
            return
        if isinstance(value, list | tuple | array | bytes):
            if len(value) > _MOST_LINES:
                raise UsageError(
                    f"'{self.label}' has {len(value)} elements; choose some, as {self.label}[0] or"
                    f" {self.label}[0:{_MOST_LINES}]"
                )
            for number, element in enumerate(value):
                self._add(f" {number}", time, element)
        else:
            self._add("", time, value)

    def _add(self, name: str, time: float, value: Any) -> None:
        if isinstance(value, TimeValue | DurationValue):
            number = value.to_nsec() / _NS
        else:
            number = float(value)
        times, values = self.lines.setdefault(name, (array("d"), array("d")))
        times.append(time)
        values.append(number if math.isfinite(number) else math.nan)


def find_curves(
    words: Sequence[str], topics: Mapping[str, Sequence[str]], load: Loader
) -> list[list[Curve]]:
    """Return the curves of each axis.

    Args:
        words: What each axis shows: fields as ``/pose/position/x``, ``/pose/position/x:y``,
            ``/scan/ranges[0]``, joined by commas; a message stands for the numbers in it.
        topics: Types by topic.
        load: Function that returns the class of a type.

    Raises:
        NotFoundError: The bag has no such topic or field.
        UsageError: A field has no numbers.
    """
    return [
        [
            curve
            for part in re.split(r",(?![^\[]*\])", word)
            if part
            for name in FieldPath.spell_out(part)
            for curve in _curves(name, topics, load)
        ]
        for word in words
    ]


def _curves(name: str, topics: Mapping[str, Sequence[str]], load: Loader) -> list[Curve]:
    target = find_target(names.join("/", name), topics, load)
    cls = load(target.type_name)
    kind = target.path.type_in(cls)
    if kind.partition("[")[0] in _NUMBERS:
        return [Curve(target.topic, target.path)]
    fields = _numbers_in(cls, target.path)
    if not fields:
        raise UsageError(f"'{name}' is a {kind}, and only numbers can be plotted")
    return [Curve(target.topic, path) for path in fields]


def _numbers_in(cls: type[Message], path: FieldPath) -> list[FieldPath]:
    """Return the paths of the numbers in a message; empty if the path leads to no message."""
    kind: Any = cls
    for step in path.steps:
        kind = next((slot.kind for slot in slots(kind) if slot.name == step.name), "")
        if isinstance(kind, str) or isinstance(step.index, slice):
            return []
    fields = zip(kind.__slots__, kind._slot_types, strict=True)
    return [FieldPath(f"{path.text}/{name}") for name, type_name in fields if type_name in _NUMBERS]


def read_curves(
    axes: Iterable[Iterable[Curve]],
    entries: Iterable[Entry],
    decoder: Callable[[Channel], Callable[[Any], Message]],
    start: int,
) -> None:
    """Add the values of messages to curves.

    Args:
        axes: The curves.
        entries: The messages.
        decoder: Function that returns what decodes the payloads of a channel.
        start: Stamp that is the time 0.

    Raises:
        DecodeError: A payload is not a message of its type.
        UsageError: A field has too many elements.
    """
    by_topic: dict[str, list[Curve]] = {}
    for axis in axes:
        for curve in axis:
            by_topic.setdefault(curve.topic, []).append(curve)
    for entry in entries:
        message = decoder(entry.channel)(entry.data)
        for curve in by_topic.get(entry.channel.topic, ()):
            curve.add((entry.stamp - start) / _NS, message)


def draw(axes: Sequence[Sequence[Curve]], file: Path, start: int, title: str = "") -> None:
    """Draw curves, and write them as PNG, SVG or PDF.

    Args:
        axes: The curves of each axis, from above.
        file: Path of the picture, whose suffix tells its format.
        start: Stamp of the time 0.
        title: Text above the picture.

    Raises:
        NotFoundError: No curve has a value.
        UsageError: The suffix is not in `FORMATS`, or the library is missing.
        BagError: The file cannot be written.
    """
    check_format(file)
    if not any(curve.lines for axis in axes for curve in axis):
        raise NotFoundError("no message of that time has such a field")
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UsageError("plots need a library: pip install 'rosz[plot]'") from error

    figure = Figure(figsize=(_WIDTH, _HEIGHT * len(axes)), layout="constrained")
    rows = figure.subplots(len(axes), sharex=True, squeeze=False)[:, 0]
    for row, axis in zip(rows, axes, strict=True):
        for curve in axis:
            for name, (times, values) in curve.lines.items():
                mark = "." if len(times) == 1 else ""
                row.plot(times, values, mark or "-", linewidth=1, label=f"{curve.label}{name}")
        row.grid(visible=True, alpha=0.3)
        if any(curve.lines for curve in axis):
            row.legend(loc="upper right", fontsize="small")
    begun = datetime.fromtimestamp(start / _NS).astimezone()
    rows[-1].set_xlabel(f"seconds since {begun:%Y-%m-%d %H:%M:%S}")
    if title:
        figure.suptitle(title, fontsize="medium")
    with FileErrors(file):
        figure.savefig(file)


def check_format(file: Path) -> None:
    """Check that pictures of a suffix can be drawn.

    Raises:
        UsageError: They cannot.
    """
    if file.suffix.lower() not in FORMATS:
        raise UsageError(f"'{file}' does not tell the format; expected {', '.join(FORMATS)}")
