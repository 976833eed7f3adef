"""Parts of the output of a node, read while it runs; bounded in bytes.

The output on the screen comes from the relay, which keeps the newest part. The output in a file of
the run's folder is read from there. A position in both tells how far a reader is.
"""

from __future__ import annotations

import codecs
import os
import re
from pathlib import Path

import msgspec

MOST_BYTES = 65536
"""Largest size of each of the two halves of an excerpt, before it is text."""
_ESCAPES = re.compile(
    r"\x1b(?:\[[0-9;?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\))|[\x00-\x08\x0b-\x1f]"
)

Position = tuple[int, int]
"""Number of bytes of the file and of the screen that have been read."""


class Excerpt(msgspec.Struct, frozen=True):
    """A part of the output of a node.

    Attributes:
        text: The text, without colors and other control characters.
        position: Where the next part begins.
        skipped: Number of bytes left out, since they are older than the kept part.
    """

    text: str
    position: Position
    skipped: int = 0


def read_file(path: Path | None, after: int, most: int = MOST_BYTES) -> tuple[int, bytes]:
    """Return the newest bytes of a file after a position, and where they begin.

    Args:
        path: The file; None if there is none.
        after: The position; if the file is shorter, it is a new one and is read from its start.
        most: Largest number of bytes.
    """
    if path is None:
        return 0, b""
    try:
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            begin = max(after if 0 <= after <= size else 0, size - most)
            stream.seek(begin)
            return begin, stream.read(most)
    except OSError:  # it is not there yet, or was removed
        return 0, b""


def make_excerpt(
    file: tuple[int, bytes], screen: tuple[int, bytes], after: Position | None
) -> Excerpt:
    """Return the bytes of a file and of the screen as text.

    Args:
        file: Where the bytes of the file begin, and the bytes.
        screen: The same for those of the screen.
        after: The position that the reader had; None for a reader that begins.
    """
    parts, position, skipped = [], [], 0
    for number, (begin, data) in enumerate((file, screen)):
        lost = begin if after is None else max(0, begin - after[number])
        text, used = _decode(data, whole=not lost)
        parts.append(text)
        position.append(begin + used)
        skipped += lost
    return Excerpt("".join(parts), (position[0], position[1]), skipped)


def _decode(data: bytes, *, whole: bool) -> tuple[str, int]:
    """Return bytes as text, and how many were used: a character that is cut off waits.

    Args:
        data: The bytes.
        whole: Whether they begin where a line or the part before them ended.
    """
    decoder = codecs.getincrementaldecoder("utf-8")("replace")
    begin = 0 if whole else data.find(b"\n") + 1
    text = decoder.decode(data[begin:])
    waiting = len(decoder.getstate()[0])
    lines = text.replace("\r\n", "\n").replace("\r", "\n")
    return _ESCAPES.sub("", lines), len(data) - waiting
