"""What two runs of a program have in common: all but times, addresses, ports and library code."""

from __future__ import annotations

import re
from ast import literal_eval
from collections.abc import Callable, Iterator, Sequence

__all__ = ("likeness",)

_CHANGING: tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...] = (
    (re.compile(r"\[\d{9,}\.\d+"), "[TIME"),
    (re.compile(r"0x[0-9a-f]{6,}"), "0xADDRESS"),
    (re.compile(r"http://[\w.-]+:\d+/?"), "http://HOST:PORT/"),
    (re.compile(r"\x1b\[[\d;]*m"), ""),
    (re.compile(r"Thread-\d+"), "Thread-N"),
    (re.compile(r"the rosdep view is empty: .*\n"), ""),
    # What the library says about itself; programs begin their own lines of this level so.
    (re.compile(r"(?m)^\[DEBUG\] \[TIME[^:]*: (?!my ).*\n"), ""),
    (re.compile(r"(?m)^\['Traceback .*\]$"), lambda found: _listed(found[0])),
)
_FRAME = re.compile(r'\s*File "(?P<path>[^"]+)", line \d+')
_MARKS = re.compile(r"\s+[~^]+\s*")


def likeness(text: str, folder: str, unlike: Sequence[str] = ()) -> str:
    """Return a program's output without what no two runs share.

    Args:
        text: The output.
        folder: Where the programs lie: of a traceback only their frames are kept.
        unlike: Lines that hold one of these are left out.
    """
    for pattern, name in _CHANGING:
        text = pattern.sub(name, text)
    lines = [line for line in text.splitlines() if not any(word in line for word in unlike)]
    return "\n".join(_own_frames(lines, folder)).strip().replace(folder, "SCRIPTS")


def _listed(text: str) -> str:
    """Return a traceback that was logged as a list of its lines."""
    lines: list[str] = literal_eval(text)
    return "".join(lines)


def _own_frames(lines: list[str], folder: str) -> Iterator[str]:
    """Yield lines but the frames of the library, and the marks below those that stay."""
    depth = None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if depth is not None and indent > depth:
            continue
        depth = None
        frame = _FRAME.match(line)
        if frame and not frame["path"].startswith(folder):
            depth = indent
        elif not _MARKS.fullmatch(line):
            yield line
