"""The layout of a picture in layers, from left to right, with few crossings; pure.

As Sugiyama, Tagawa and Toda lay out hierarchies (1981): arrows that would go round are turned, each
box gets a layer behind those that send to it, arrows over several layers get a bend in each, each
layer is put into the order of the mean places of its neighbours, and boxes move towards these.
"""

from __future__ import annotations

import itertools
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

import msgspec

from rosz.diagram.picture import Box, Picture

__all__ = ("Layout", "Place", "lay_out")

_LETTER = 7.2
_NARROWEST = 56.0
_BETWEEN_ROWS = 16.0
_BEND_GAP = 10.0
_MARGIN = 16.0
_TURNED_SHIFT = 9.0
_HEIGHT = {"node": 36.0, "topic": 28.0}
_ORDER_SWEEPS = 8
_PLACE_SWEEPS = 8
_MOST_BENDS = 20_000
"""Bends above which arrows go straight: a picture that no person reads anyway."""


class Place(msgspec.Struct, frozen=True):
    """Position and size of a box, in pixels.

    Attributes:
        box: The box.
        x: Left side.
        y: Upper side.
        width: Width.
        height: Height.
    """

    box: Box
    x: float
    y: float
    width: float
    height: float


class Layout(msgspec.Struct, frozen=True):
    """Positions of all boxes and arrows, in pixels.

    Attributes:
        places: The place of each box, by key.
        paths: The points of each arrow of the picture, in its order.
        width: Width of the whole.
        height: Height of the whole.
    """

    places: dict[str, Place]
    paths: list[list[tuple[float, float]]]
    width: float
    height: float


class _Vertex:
    """A box, or a bend of an arrow."""

    __slots__ = ("after", "before", "box", "height", "layer", "order", "width", "y")

    def __init__(self, box: Box | None, layer: int) -> None:
        self.box = box
        self.layer = layer
        self.order = 0.0
        self.y = 0.0
        self.width = 0.0 if box is None else max(_NARROWEST, len(box.name) * _LETTER + 24)
        self.height = 0.0 if box is None else _HEIGHT[box.kind]
        self.before: list[_Vertex] = []
        self.after: list[_Vertex] = []

    @property
    def gap(self) -> float:
        return _BEND_GAP if self.box is None else _BETWEEN_ROWS


@lru_cache(maxsize=4)
def lay_out(picture: Picture, gap: float = 64.0) -> Layout:
    """Return the layout of a picture.

    Args:
        picture: The picture.
        gap: Width between two layers, in which arrows and their labels are.
    """
    keys = [box.key for box in picture.boxes]
    edges = [(arrow.start, arrow.end) for arrow in picture.arrows]
    forward = _acyclic(keys, edges)
    layer_of = _layer(keys, [pair for pair in forward if pair[0] != pair[1]])
    vertices = {box.key: _Vertex(box, layer_of[box.key]) for box in picture.boxes}
    chains = _chain(vertices, forward)
    layers = _collect(vertices, chains)
    _order(layers)
    _place(layers)
    return _measure(picture, vertices, chains, layers, forward, gap)


def _acyclic(keys: Sequence[str], edges: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the edges, those turned that close a circle in a search from the sources."""
    after: dict[str, list[str]] = {key: [] for key in keys}
    indegree = dict.fromkeys(keys, 0)
    for start, end in edges:
        after[start].append(end)
        indegree[end] += 1
    state: dict[str, int] = {}  # 1 while on the path, 2 when done
    back: set[tuple[str, str]] = set()
    for root in sorted(keys, key=lambda key: (indegree[key], key)):
        if root in state:
            continue
        state[root] = 1
        stack = [(root, iter(after[root]))]
        while stack:
            key, rest = stack[-1]
            for other in rest:
                if state.get(other) == 1:
                    back.add((key, other))
                elif other not in state:
                    state[other] = 1
                    stack.append((other, iter(after[other])))
                    break
            else:
                state[key] = 2
                stack.pop()
    return [(end, start) if (start, end) in back else (start, end) for start, end in edges]


def _layer(keys: Sequence[str], edges: Iterable[tuple[str, str]]) -> dict[str, int]:
    """Return the layer of each box: behind all before it, sources right before their first."""
    after: dict[str, list[str]] = {key: [] for key in keys}
    waiting = dict.fromkeys(keys, 0)
    for start, end in edges:
        after[start].append(end)
        waiting[end] += 1
    sources = {key for key in keys if not waiting[key]}
    layer = dict.fromkeys(keys, 0)
    ready = [key for key in keys if not waiting[key]]
    for key in ready:
        for other in after[key]:
            layer[other] = max(layer[other], layer[key] + 1)
            waiting[other] -= 1
            if not waiting[other]:
                ready.append(other)
    for key in sources:
        if after[key]:
            layer[key] = min(layer[other] for other in after[key]) - 1
    return layer


def _chain(
    vertices: Mapping[str, _Vertex], edges: Sequence[tuple[str, str]]
) -> list[list[_Vertex]]:
    """Join the boxes of each edge, by a bend in each layer between them."""
    spans = sum(abs(vertices[end].layer - vertices[start].layer) for start, end in edges)
    bends = spans <= _MOST_BENDS
    chains: list[list[_Vertex]] = []
    for start, end in edges:
        first, last = vertices[start], vertices[end]
        between = range(first.layer + 1, last.layer) if bends else ()
        chain = [first, *(_Vertex(None, layer) for layer in between), last]
        if first is not last:
            for one, other in itertools.pairwise(chain):
                one.after.append(other)
                other.before.append(one)
        chains.append(chain)
    return chains


def _collect(
    vertices: Mapping[str, _Vertex], chains: Iterable[list[_Vertex]]
) -> list[list[_Vertex]]:
    """Return the vertices of each layer, in groups, and beside each other by first sight."""
    count = max((one.layer for one in vertices.values()), default=-1) + 1
    layers: list[list[_Vertex]] = [[] for _ in range(count)]
    boxes = [one for one in vertices.values() if one.box is not None]
    for one in sorted(boxes, key=lambda vertex: vertex.box.group if vertex.box else ""):
        layers[one.layer].append(one)
    for chain in chains:
        for bend in chain[1:-1]:
            layers[bend.layer].append(bend)
    return layers


def _order(layers: list[list[_Vertex]]) -> None:
    """Order each layer by the mean order of its neighbours, there and back."""
    for layer in layers:
        _number(layer)
    best, fewest = [list(layer) for layer in layers], _crossings(layers)
    for sweep in range(_ORDER_SWEEPS):
        if not fewest:
            break
        forth = sweep % 2 == 0
        for layer in layers if forth else reversed(layers):
            wanted = {}
            for one in layer:
                near = one.before if forth else one.after
                wanted[one] = _mean([other.order for other in near]) if near else one.order
            layer.sort(key=wanted.__getitem__)
            _number(layer)
        found = _crossings(layers)
        if found < fewest:
            best, fewest = [list(layer) for layer in layers], found
    for layer, order in zip(layers, best, strict=True):
        layer[:] = order
        _number(layer)


def _number(layer: Iterable[_Vertex]) -> None:
    for number, one in enumerate(layer):
        one.order = float(number)


def _mean(values: Sequence[float]) -> float:
    return values[0] if len(values) == 1 else sum(values) / len(values)


def _crossings(layers: Iterable[list[_Vertex]]) -> int:
    """Return how often edges cross."""
    total = 0
    for layer in layers:
        ends: list[float] = []
        for one in layer:
            if len(one.after) == 1:  # as all bends
                ends.append(one.after[0].order)
            else:
                ends += sorted([other.order for other in one.after])
        total += _inversions(ends)
    return total


def _inversions(values: Iterable[float]) -> int:
    """Return how many pairs are in the wrong order."""
    total = 0
    seen: list[float] = []
    for value in values:
        position = bisect_right(seen, value)
        total += len(seen) - position
        seen.insert(position, value)
    return total


def _place(layers: list[list[_Vertex]]) -> None:
    """Move the vertices of each layer towards their neighbours, without changing its order."""
    for layer in layers:
        y = 0.0
        for one in layer:
            one.y = y + one.height / 2
            y += one.height + one.gap
    for sweep in range(_PLACE_SWEEPS):
        forth = sweep % 2 == 0
        for layer in layers if forth else reversed(layers):
            wanted = []
            for one in layer:
                near = (one.before if forth else one.after) or one.after or one.before
                wanted.append(_mean([other.y for other in near]) if near else one.y)
            _spread(layer, wanted)


def _spread(layer: Sequence[_Vertex], wanted: Sequence[float]) -> None:
    """Give each vertex the nearest free place to where it is wanted, by least squares.

    Vertices that would overlap form a block, whose place is the mean of what its members want.
    """
    offsets: list[float] = []
    y = 0.0
    for number, one in enumerate(layer):
        if number:
            before = layer[number - 1]
            y += (before.height + one.height) / 2 + max(before.gap, one.gap)
        offsets.append(y)
    blocks: list[tuple[float, int]] = []  # the sum of wanted places, less offsets, and the count
    for want, offset in zip(wanted, offsets, strict=True):
        total, count = want - offset, 1
        while blocks and blocks[-1][0] / blocks[-1][1] >= total / count:
            before_total, before_count = blocks.pop()
            total, count = total + before_total, count + before_count
        blocks.append((total, count))
    number = 0
    for total, count in blocks:
        for _ in range(count):
            layer[number].y = total / count + offsets[number]
            number += 1


def _measure(
    picture: Picture,
    vertices: Mapping[str, _Vertex],
    chains: Sequence[list[_Vertex]],
    layers: Sequence[list[_Vertex]],
    forward: Sequence[tuple[str, str]],
    gap: float,
) -> Layout:
    """Return places and paths in numbers that begin at a margin."""
    top = min((one.y - one.height / 2 for layer in layers for one in layer), default=0.0)
    bottom = max((one.y + one.height / 2 for layer in layers for one in layer), default=0.0)
    lefts, widths, x = [], [], _MARGIN
    for layer in layers:
        width = max((one.width for one in layer), default=0.0)
        lefts.append(x)
        widths.append(width)
        x += width + gap
    shift = _MARGIN - top
    places: dict[str, Place] = {}
    for box in picture.boxes:
        one = vertices[box.key]
        left = lefts[one.layer] + (widths[one.layer] - one.width) / 2
        y = one.y - one.height / 2 + shift
        places[box.key] = Place(box, left, y, one.width, one.height)
    paths = []
    for chain, arrow, (start, _) in zip(chains, picture.arrows, forward, strict=True):
        turned = start != arrow.start
        # An arrow back is a little lower than one there, which may have the same ends.
        path = _path(chain, places, lefts, widths, shift + _TURNED_SHIFT * turned)
        paths.append(path[::-1] if turned else path)
    width = max(x - gap + _MARGIN, 2 * _MARGIN)
    return Layout(places, paths, width, bottom - top + 2 * _MARGIN)


def _path(
    chain: Sequence[_Vertex],
    places: Mapping[str, Place],
    lefts: Sequence[float],
    widths: Sequence[float],
    shift: float,
) -> list[tuple[float, float]]:
    first, last = chain[0], chain[-1]
    assert first.box is not None and last.box is not None  # noqa: S101, PT018  # ends are boxes
    start, end = places[first.box.key], places[last.box.key]
    if first is last:  # a loop above the box
        right, up = start.x + start.width / 2, start.y
        return [(right + 12, up), (right + 12, up - 14), (right - 12, up - 14), (right - 12, up)]
    points = [(start.x + start.width, first.y + shift)]
    for bend in chain[1:-1]:
        y = bend.y + shift
        points += [(lefts[bend.layer], y), (lefts[bend.layer] + widths[bend.layer], y)]
    return [*points, (end.x, last.y + shift)]
