"""What the doctor has found: its name, what shows it, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import msgspec

__all__ = ("Finding", "Level", "error", "listed", "warning")

Level = Literal["error", "warning"]
_SHOWN = 8
"""Lines of evidence beyond which the rest is only counted."""


class Finding(msgspec.Struct, frozen=True):
    """Something that is wrong, or may be.

    Attributes:
        name: Short and stable, for programs: ``clock-offset``.
        level: ``error`` for what keeps something from working; ``warning`` for what may be meant.
        text: What it is, in a line.
        evidence: What shows it, a line each.
        remedy: What to do.
    """

    name: str
    level: Level
    text: str
    evidence: tuple[str, ...]
    remedy: str


def error(name: str, text: str, evidence: Iterable[str], remedy: str) -> Finding:
    """Return a finding about what keeps something from working."""
    return Finding(name, "error", text, tuple(evidence), remedy)


def warning(name: str, text: str, evidence: Iterable[str], remedy: str) -> Finding:
    """Return a finding about what may be meant."""
    return Finding(name, "warning", text, tuple(evidence), remedy)


def listed(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Return evidence for people, what is too much of it only counted."""
    more = len(lines) - _SHOWN
    return (*lines[:_SHOWN], f"and {more} more") if more > 1 else lines
