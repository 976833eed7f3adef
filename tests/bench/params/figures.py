"""Figures, and the table they make."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence


class Figure:
    """One thing that is measured, for rosz and where there is such a thing for ROS 1.

    Args:
        name: What it is.
        unit: ``us``, ``ms`` or ``s``.
        target: What is asked for, for people.
    """

    SCALE = {"us": 1e6, "ms": 1e3, "s": 1.0}  # noqa: RUF012  # read only

    def __init__(self, name: str, unit: str, target: str = "") -> None:
        self.name = name
        self.unit = unit
        self.target = target
        self.rosz: list[float] = []
        self.ros1: list[float] = []

    def row(self) -> tuple[str, ...]:
        """Return what stands in the table."""
        ours = statistics.median(self.rosz) if self.rosz else None
        theirs = statistics.median(self.ros1) if self.ros1 else None
        ratio = f"{ours / theirs:.3g}" if ours and theirs else "-"
        return self.name, self._shown(ours), self._shown(theirs), ratio, self.target

    def _shown(self, seconds: float | None) -> str:
        return "-" if seconds is None else f"{seconds * self.SCALE[self.unit]:.3g} {self.unit}"


def table(figures: Iterable[Figure]) -> str:
    """Return figures as a table in Markdown."""
    head = ("", "rosz", "ROS 1", "rosz : ROS 1", "asked for")
    rows = [head, *(figure.row() for figure in figures)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    lines = [_line(row, widths) for row in rows]
    rule = "|".join("-" * (width + 2) for width in widths)
    return "\n".join([lines[0], f"|{rule}|", *lines[1:]])


def percentile(values: Sequence[float], percent: float) -> float:
    """Return the value that so many percent of all do not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


def _line(row: Sequence[str], widths: Sequence[int]) -> str:
    cells = (f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
    return f"| {' | '.join(cells)} |"
