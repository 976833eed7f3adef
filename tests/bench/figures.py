"""What a benchmark found, for rosz and for those it is compared with, and the table of it."""

from __future__ import annotations

import os
import statistics
from collections.abc import Iterable, Mapping, Sequence

__all__ = ("OWN", "Figure", "busy", "percentile", "table")

OWN = "rosz"
_SCALES = {"µs": 1e6, "ms": 1e3, "s": 1.0}
_WHOLE = 1000


class Figure:
    """One thing that is measured, round by round, for each system in turn.

    Args:
        name: What it is.
        unit: ``µs``, ``ms`` or ``s`` for what is measured in seconds; any other is printed as it
            is.
        asked: What rosz is compared with, and what is asked of the ratio to each, for people.
        own: What it is called where rosz is measured, if not `OWN`.
    """

    def __init__(
        self, name: str, unit: str, asked: Mapping[str, str] | None = None, own: str = OWN
    ) -> None:
        self.name = name
        self.unit = unit
        self.asked = dict(asked or {})
        self.own = own
        self.found: dict[str, list[float]] = {}

    @property
    def systems(self) -> list[str]:
        """Whom it is measured for, rosz first."""
        return [self.own, *self.asked]

    def add(self, system: str, value: float) -> None:
        """Take down what a system reached in a round."""
        self.found.setdefault(system, []).append(value)

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Return what stands in the table: a row for each system that rosz is compared with."""
        ours = self.found.get(self.own, [])
        name = f"{self.name}, {self.unit}"
        rows = [
            (
                name,
                self._median(ours),
                f"{system}: {self._median(theirs)}",
                ratio(ours, theirs),
                aim,
            )
            for system, aim in self.asked.items()
            if (theirs := self.found.get(system))
        ]
        return rows or [(name, self._median(ours), "-", "-", "; ".join(self.asked.values()))]

    def _median(self, values: Sequence[float]) -> str:
        if not values:
            return "-"
        value = statistics.median(values) * _SCALES.get(self.unit, 1.0)
        return f"{value:.0f}" if value >= _WHOLE else f"{value:.3g}"


def ratio(ours: Sequence[float], theirs: Sequence[float]) -> str:
    """Return the median of the rounds' ratios: what disturbs a round disturbs both alike."""
    pairs = [a / b for a, b in zip(ours, theirs, strict=False) if b]
    return f"{statistics.median(pairs):.3g}" if pairs else "-"


def table(figures: Iterable[Figure]) -> str:
    """Return figures as a table in Markdown."""
    head = ("", OWN, "other", f"{OWN} : other", "asked for")
    rows = [head, *(row for figure in figures for row in figure.rows())]
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    lines = [_line(row, widths) for row in rows]
    rule = "|".join("-" * (width + 2) for width in widths)
    return "\n".join([lines[0], f"|{rule}|", *lines[1:]])


def percentile(values: Sequence[float], percent: float) -> float:
    """Return the value that so many percent of all do not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


def busy() -> str:
    """Tell how busy the machine is, benchmark included: without that, no figure means much."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


def _line(row: Sequence[str], widths: Sequence[int]) -> str:
    cells = (f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
    return f"| {' | '.join(cells)} |"
