"""Findings of the doctor: a name, the evidence, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import msgspec

__all__ = ("Finding", "Level", "error", "listed", "warning")

Level = Literal["error", "warning"]
_SHOWN = 8
"""Number of lines of evidence that are shown to people."""


class Finding(msgspec.Struct, frozen=True):
    """A fault, or something that may be one.

    Attributes:
        name: Short stable name for programs, such as ``clock-offset``.
        level: ``error`` for a fault; ``warning`` for what may be intended.
        text: Description in one line.
        evidence: Lines of evidence.
        remedy: What to do about it.
    """

    name: str
    level: Level
    text: str
    evidence: tuple[str, ...]
    remedy: str


def error(name: str, text: str, evidence: Iterable[str], remedy: str) -> Finding:
    """Return a finding about a fault."""
    return Finding(name, "error", text, tuple(evidence), remedy)


def warning(name: str, text: str, evidence: Iterable[str], remedy: str) -> Finding:
    """Return a finding about what may be intended."""
    return Finding(name, "warning", text, tuple(evidence), remedy)


def listed(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Return lines of evidence for people, with the number of those left out."""
    more = len(lines) - _SHOWN
    return (*lines[:_SHOWN], f"and {more} more") if more > 1 else lines
