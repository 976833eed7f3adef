"""Places for the labels of arrows, chosen so that no label covers another."""

from __future__ import annotations

import itertools
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence

_LETTER = 6.0
_AROUND = 6.0
_ROW = 13.0
_AT_END, _AT_START = (0.85, 0.6, 0.4, 0.2), (0.5, 0.3, 0.7)
"""Parts of the room in a gap; a label near the end is near the topic that it is about."""
_STEPS = 32


def _curve() -> tuple[list[float], list[float]]:
    """Return points of the curve from one level to another, whose sides are 1 long."""
    steps = [step / _STEPS for step in range(_STEPS + 1)]
    across = [1.5 * part * (1 - part) + part**3 for part in steps]
    return across, [part * part * (3 - 2 * part) for part in steps]


_ACROSS, _ALONG = _curve()


def place_labels(
    paths: Iterable[Sequence[tuple[float, float]]], letters: Iterable[int]
) -> list[tuple[float, float, bool]]:
    """Return the middle of each label, and whether it has room there.

    A label is on its arrow, in the gap before the box that the arrow reaches or in the one behind
    the box that it leaves, where no other label is.

    Args:
        paths: The points of each arrow.
        letters: Number of letters of each label; 0 for none.
    """
    taken: dict[int, list[tuple[float, float, float]]] = {}
    placed = []
    for path, count in zip(paths, letters, strict=True):
        width = count * _LETTER + _AROUND
        places = list(_places(path, width))
        free = next((at for at in places if count and _is_free(at, width, taken)), None)
        x, y = free or places[0]
        placed.append((x, y, free is not None or not count))
        if free is not None:
            taken.setdefault(int(y // _ROW), []).append((x - width / 2, x + width / 2, y))
    return placed


def _places(path: Sequence[tuple[float, float]], width: float) -> Iterator[tuple[float, float]]:
    if path[0][0] == path[1][0]:  # a loop above its box
        yield (path[1][0] + path[2][0]) / 2, path[1][1]
        return
    for first, fractions in ((len(path) - 2, _AT_END), (0, _AT_START)):
        (left, up), (right, down) = path[first], path[first + 1]
        across = abs(right - left)
        room = max(0.0, across - width)
        for fraction in fractions:
            way = (width / 2 + fraction * room) / across if room else 0.5
            yield left + way * (right - left), up + _ALONG[bisect_left(_ACROSS, way)] * (down - up)


def _is_free(
    at: tuple[float, float], width: float, taken: dict[int, list[tuple[float, float, float]]]
) -> bool:
    x, y = at
    row = int(y // _ROW)
    near = itertools.chain.from_iterable(
        taken.get(near_row, ()) for near_row in (row - 1, row, row + 1)
    )
    return not any(
        abs(y - other) < _ROW and x - width / 2 < right and left < x + width / 2
        for left, right, other in near
    )
