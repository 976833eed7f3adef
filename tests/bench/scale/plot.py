"""The figures of a crowd as a picture, in SVG and without a library."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .sight import Sight

__all__ = ("plot",)

_WIDTH, _HEIGHT, _MARGIN = 360, 240, 46
_COLUMNS = 4
_COLOURS = {"mesh": "#c0392b", "star": "#2471a3", "cores": "#b9770e", "stars": "#1e8449"} | {
    "shared": "#7d3c98",
    "bare": "#707b7c",
}
_PANELS = {
    "complete": "complete graph, s",
    "busy": "core seconds for it, each",
    "traffic": "traffic for it, each, kB",
    "newcomer": "newcomer sees all and is heard, s",
    "memory": "memory, each, MB",
    "idle": "idle, each, % of a core",
    "set_ms": "acknowledged set, ms",
}
_LEAST = 1e-3


def plot(sights: Sequence[Sight]) -> str:
    """Return a picture with one panel for each figure, both axes logarithmic."""
    panels = [
        f'<g transform="translate({index % _COLUMNS * _WIDTH},{index // _COLUMNS * _HEIGHT})">'
        f"{_panel(sights, name, title)}</g>"
        for index, (name, title) in enumerate(_PANELS.items())
    ]
    rows = math.ceil(len(_PANELS) / _COLUMNS)
    size = f'width="{_COLUMNS * _WIDTH}" height="{rows * _HEIGHT}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">'
    return f'{head}<rect width="100%" height="100%" fill="white"/>{"".join(panels)}</svg>\n'


def _panel(sights: Sequence[Sight], name: str, title: str) -> str:
    values = {
        (one.mode, one.count): max(value, _LEAST)
        for one in sights
        if not math.isnan(value := getattr(one, name))
    }
    parts = [f'<text x="{_MARGIN}" y="18" font-size="13">{title}</text>']
    if not values:
        return "".join(parts)
    across = _Scale([one.count for one in sights], _MARGIN, _WIDTH - 12)
    up = _Scale(list(values.values()), _HEIGHT - _MARGIN + 14, 30)
    parts += (
        _text(across.place(count), _HEIGHT - 14, str(count), "middle")
        for count in sorted({one.count for one in sights})
    )
    parts += (
        _text(_MARGIN - 6, up.place(value) + 4, f"{value:.3g}", "end")
        for value in (up.low, up.high)
    )
    for mode, colour in _COLOURS.items():
        points = [
            (across.place(count), up.place(value))
            for (its, count), value in values.items()
            if its == mode
        ]
        parts += _line(points, mode, colour)
    return "".join(parts)


def _line(points: Sequence[tuple[float, float]], mode: str, colour: str) -> list[str]:
    if not points:
        return []
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return [
        f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>',
        *(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points),
        _text(points[-1][0], points[-1][1] - 7, mode, "end"),
    ]


class _Scale:
    """A logarithmic axis between two places."""

    def __init__(self, values: Sequence[float], begin: float, end: float) -> None:
        self.low, self.high = min(values), max(values)
        self._begin, self._end = begin, end

    def place(self, value: float) -> float:
        span = math.log(self.high / self.low) or 1.0
        return self._begin + (self._end - self._begin) * math.log(value / self.low) / span


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="11" text-anchor="{anchor}">{text}</text>'
