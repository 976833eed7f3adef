"""The figures of a crowd as a picture, in SVG and without a library."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .crowd import Sight

__all__ = ("plot",)

_WIDTH, _HEIGHT, _MARGIN = 360, 240, 46
_COLOURS = {"mesh": "#c0392b", "star": "#2471a3"}
_PANELS = {
    "complete": "complete graph, s",
    "memory": "memory of a node, MB",
    "cpu": "idle node, % of a core",
    "traffic": "traffic of a node, kB",
    "set_ms": "acknowledged set, ms",
}


def plot(sights: Sequence[Sight]) -> str:
    """Return a picture with one panel for each figure, both axes logarithmic."""
    panels = [
        f'<g transform="translate({index % 3 * _WIDTH},{index // 3 * _HEIGHT})">'
        f"{_panel(sights, name, title)}</g>"
        for index, (name, title) in enumerate(_PANELS.items())
    ]
    size = f'width="{3 * _WIDTH}" height="{2 * _HEIGHT}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">'
    return f'{head}<rect width="100%" height="100%" fill="white"/>{"".join(panels)}</svg>\n'


def _panel(sights: Sequence[Sight], name: str, title: str) -> str:
    values = {(one.mode, one.count): max(getattr(one, name), 1e-3) for one in sights}
    across = _Scale([one.count for one in sights], _MARGIN, _WIDTH - 12)
    up = _Scale(list(values.values()), _HEIGHT - _MARGIN + 14, 30)
    parts = [f'<text x="{_MARGIN}" y="18" font-size="13">{title}</text>']
    for count in sorted({one.count for one in sights}):
        x = across.place(count)
        parts.append(_text(x, _HEIGHT - 14, str(count), "middle"))
    for value in (up.low, up.high):
        y = up.place(value)
        parts.append(_text(_MARGIN - 6, y + 4, f"{value:.3g}", "end"))
    for mode, colour in _COLOURS.items():
        points = [
            (across.place(one.count), up.place(values[mode, one.count]))
            for one in sights
            if one.mode == mode
        ]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]
        if points:
            parts.append(_text(points[-1][0], points[-1][1] - 7, mode, "end"))
    return "".join(parts)


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
