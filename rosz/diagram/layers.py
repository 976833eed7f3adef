"""The layout of a picture in layers, from left to right, with few crossings; pure.

As Sugiyama, Tagawa and Toda lay out hierarchies (1981): arrows that would go round are turned, each
box gets a layer right of those that send to it, arrows over several layers get a bend in each, each
layer is put into the order of the mean places of its neighbours, and boxes move towards these.
"""

from __future__ import annotations

import itertools
import operator
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

import msgspec

from rosz.diagram.picture import Box, Picture

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


class BoxPlace(msgspec.Struct, frozen=True):
    """Upper left corner and size of a box, in pixels."""

    box: Box
    x: float
    y: float
    width: float
    height: float


class PictureLayout(msgspec.Struct, frozen=True):
    """Places of boxes by their keys, points of arrows in their order, and the size, in pixels."""

    places: dict[str, BoxPlace]
    paths: list[list[tuple[float, float]]]
    width: float
    height: float


class _Layers:
    """The vertices of a picture, by number: its boxes, and then the bends of its arrows.

    Vertices are integers, because a large picture has about ten thousand bends. ``before`` and
    ``after`` are the neighbours of each in the adjacent layers.
    """

    def __init__(self, picture: Picture) -> None:
        self.boxes = picture.boxes
        self.widths = [max(_NARROWEST, len(box.name) * _LETTER + 24) for box in self.boxes]
        self.heights = [_HEIGHT[box.kind] for box in self.boxes]
        self.layer_of: list[int] = []
        self.before: list[list[int]] = [[] for _ in self.boxes]
        self.after: list[list[int]] = [[] for _ in self.boxes]

    def add_bend(self, layer: int) -> int:
        """Add a bend in a layer, and return its number."""
        self.layer_of.append(layer)
        self.before.append([])
        self.after.append([])
        return len(self.layer_of) - 1

    def join(self, vertex: int, other: int) -> None:
        """Make vertices of adjacent layers neighbours."""
        self.after[vertex].append(other)
        self.before[other].append(vertex)

    def height(self, vertex: int) -> float:
        """Return the height of a vertex."""
        return self.heights[vertex] if vertex < len(self.boxes) else 0.0

    def gap(self, vertex: int) -> float:
        """Return how far a vertex keeps from others of its layer."""
        return _BETWEEN_ROWS if vertex < len(self.boxes) else _BEND_GAP


@lru_cache(maxsize=4)
def lay_out(picture: Picture, gap: float = 64.0) -> PictureLayout:
    """Return the layout of a picture.

    Args:
        picture: The picture.
        gap: Width between two layers, in which arrows and their labels are.
    """
    keys = [box.key for box in picture.boxes]
    edges = [(arrow.start, arrow.end) for arrow in picture.arrows]
    forward = _acyclic(keys, edges)
    layers_by_key = _assign_layers(keys, [pair for pair in forward if pair[0] != pair[1]])
    graph = _Layers(picture)
    graph.layer_of += [layers_by_key[key] for key in keys]
    chains = _make_chains(graph, forward)
    layers = _vertices_by_layer(graph, chains)
    _order_layers(graph, layers)
    return _make_layout(picture, graph, chains, layers, _find_middles(graph, layers), gap)


def _acyclic(keys: Sequence[str], edges: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the edges, with those reversed that close a cycle in a search from the sources."""
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


def _assign_layers(keys: Sequence[str], edges: Iterable[tuple[str, str]]) -> dict[str, int]:
    """Return layers: boxes right of predecessors, sources just left of their first successor."""
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


def _make_chains(graph: _Layers, edges: Sequence[tuple[str, str]]) -> list[list[int]]:
    """Join the boxes of each edge, by a bend in each layer between them."""
    number = {box.key: number for number, box in enumerate(graph.boxes)}
    ends = [(number[start], number[end]) for start, end in edges]
    spans = sum(abs(graph.layer_of[last] - graph.layer_of[first]) for first, last in ends)
    bends = spans <= _MOST_BENDS
    chains = []
    for first, last in ends:
        between = range(graph.layer_of[first] + 1, graph.layer_of[last]) if bends else ()
        chain = [first, *map(graph.add_bend, between), last]
        if first != last:
            for vertex, other in itertools.pairwise(chain):
                graph.join(vertex, other)
        chains.append(chain)
    return chains


def _vertices_by_layer(graph: _Layers, chains: Iterable[list[int]]) -> list[list[int]]:
    """Return the vertices of each layer: the boxes sorted by group, then the bends."""
    layers: list[list[int]] = [[] for _ in range(max(graph.layer_of, default=-1) + 1)]
    for vertex in sorted(range(len(graph.boxes)), key=lambda vertex: graph.boxes[vertex].group):
        layers[graph.layer_of[vertex]].append(vertex)
    for chain in chains:
        for bend in chain[1:-1]:
            layers[graph.layer_of[bend]].append(bend)
    return layers


def _order_layers(graph: _Layers, layers: list[list[int]]) -> None:
    """Order each layer by the mean order of its neighbours, in sweeps to the right and back."""
    order = [0] * len(graph.layer_of)
    for layer in layers:
        _note_order(layer, order)
    before = [near or [vertex] for vertex, near in enumerate(graph.before)]
    after = [near or [vertex] for vertex, near in enumerate(graph.after)]
    best, fewest = [list(layer) for layer in layers], _crossings(graph, layers, order)
    for sweep in range(_ORDER_SWEEPS):
        if not fewest:
            break
        forth = sweep % 2 == 0
        for layer in layers if forth else reversed(layers):
            wanted = _means(layer, before if forth else after, order)
            layer[:] = [layer[at] for at in sorted(range(len(layer)), key=wanted.__getitem__)]
            _note_order(layer, order)
        crossings = _crossings(graph, layers, order)
        if crossings < fewest:
            best, fewest = [list(layer) for layer in layers], crossings
    layers[:] = best


def _note_order(layer: Iterable[int], order: list[int]) -> None:
    for number, vertex in enumerate(layer):
        order[vertex] = number


def _means(
    layer: Iterable[int], near: Sequence[Sequence[int]], values: Sequence[float]
) -> list[float]:
    """Return the mean value of the neighbours of each vertex; bends have one on each side."""
    return [
        values[others[0]] if len(others) == 1 else sum([values[at] for at in others]) / len(others)
        for others in map(near.__getitem__, layer)
    ]


def _crossings(graph: _Layers, layers: Iterable[list[int]], order: Sequence[int]) -> int:
    total = 0
    for layer in layers:
        ends: list[int] = []
        for others in map(graph.after.__getitem__, layer):
            if len(others) == 1:  # as all bends
                ends.append(order[others[0]])
            else:
                ends += sorted([order[at] for at in others])
        total += _inversions(ends)
    return total


def _inversions(values: Iterable[int]) -> int:
    """Return how many pairs are in the wrong order."""
    total = 0
    seen: list[int] = []
    for value in values:
        if not seen or seen[-1] <= value:
            seen.append(value)
        else:
            position = bisect_right(seen, value)
            total += len(seen) - position
            seen.insert(position, value)
    return total


def _find_middles(graph: _Layers, layers: Sequence[list[int]]) -> list[float]:
    """Return the middles of vertices, moved towards their neighbours in the order of layers."""
    middles = [0.0] * len(graph.layer_of)
    offsets = []
    for layer in layers:
        y = 0.0
        for vertex in layer:
            middles[vertex] = y + graph.height(vertex) / 2
            y += graph.height(vertex) + graph.gap(vertex)
        offsets.append(_offsets(graph, layer))
    near = list(zip(graph.before, graph.after, strict=True))
    before = [before or after or [vertex] for vertex, (before, after) in enumerate(near)]
    after = [after or before or [vertex] for vertex, (before, after) in enumerate(near)]
    rows = list(zip(layers, offsets, strict=True))
    for sweep in range(_PLACE_SWEEPS):
        forth = sweep % 2 == 0
        for layer, distances in rows if forth else reversed(rows):
            wanted = _means(layer, before if forth else after, middles)
            for vertex, middle in zip(layer, _spread(wanted, distances), strict=True):
                middles[vertex] = middle
    return middles


def _offsets(graph: _Layers, layer: Sequence[int]) -> list[float]:
    """Return how far each vertex of a layer is at least below the first one."""
    offsets = [0.0] * bool(layer)
    for before, vertex in itertools.pairwise(layer):
        apart = (graph.height(before) + graph.height(vertex)) / 2
        offsets.append(offsets[-1] + apart + max(graph.gap(before), graph.gap(vertex)))
    return offsets


def _spread(wanted: Sequence[float], offsets: Sequence[float]) -> Iterator[float]:
    """Give each vertex the nearest free place to where it is wanted, by least squares.

    Vertices that would overlap form a block; its place is the mean of those that its members want.
    """
    totals: list[float] = []
    counts: list[int] = []
    means: list[float] = []
    for want, offset in zip(wanted, offsets, strict=True):
        total = mean = want - offset
        count = 1
        while means and means[-1] >= mean:
            means.pop()
            total += totals.pop()
            count += counts.pop()
            mean = total / count
        totals.append(total)
        counts.append(count)
        means.append(mean)
    starts = itertools.chain.from_iterable(map(itertools.repeat, means, counts))
    return map(operator.add, starts, offsets)


def _make_layout(
    picture: Picture,
    graph: _Layers,
    chains: Sequence[list[int]],
    layers: Sequence[list[int]],
    middles: Sequence[float],
    gap: float,
) -> PictureLayout:
    """Return the layout in pixels, with a margin on each side."""
    heights = [*map(graph.height, range(len(middles)))]
    top = min((y - height / 2 for y, height in zip(middles, heights, strict=True)), default=0.0)
    bottom = max((y + height / 2 for y, height in zip(middles, heights, strict=True)), default=0.0)
    lefts, widths, x = [], [], _MARGIN
    for layer in layers:
        boxes = (vertex for vertex in layer if vertex < len(graph.boxes))
        width = max((graph.widths[vertex] for vertex in boxes), default=0.0)
        lefts.append(x)
        widths.append(width)
        x += width + gap
    shift = _MARGIN - top
    places: dict[str, BoxPlace] = {}
    for vertex, box in enumerate(graph.boxes):
        at, width, height = graph.layer_of[vertex], graph.widths[vertex], graph.heights[vertex]
        left = lefts[at] + (widths[at] - width) / 2
        places[box.key] = BoxPlace(box, left, middles[vertex] - height / 2 + shift, width, height)
    columns = [(left, left + width) for left, width in zip(lefts, widths, strict=True)]
    paths = []
    for chain, arrow in zip(chains, picture.arrows, strict=True):
        first, last = (places[graph.boxes[vertex].key] for vertex in (chain[0], chain[-1]))
        turned = first.box.key != arrow.start
        # A turned arrow is a little lower than a forward one between the same boxes.
        lower = shift + _TURNED_SHIFT * turned
        bends = [(*columns[graph.layer_of[bend]], middles[bend] + lower) for bend in chain[1:-1]]
        path = _path(first, last, bends, _TURNED_SHIFT * turned)
        paths.append(path[::-1] if turned else path)
    width = max(x - gap + _MARGIN, 2 * _MARGIN)
    return PictureLayout(places, paths, width, bottom - top + 2 * _MARGIN)


def _path(
    first: BoxPlace, last: BoxPlace, bends: Iterable[tuple[float, float, float]], lower: float
) -> list[tuple[float, float]]:
    """Return the points of an arrow, which is horizontal within the layers that it passes.

    A bend is the left and the right side of a layer, and the height at which the arrow passes.
    """
    if first is last:  # a loop above the box
        right, up = first.x + first.width / 2, first.y
        return [(right + 12, up), (right + 12, up - 14), (right - 12, up - 14), (right - 12, up)]
    points = [(first.x + first.width, first.y + first.height / 2 + lower)]
    for left, right, y in bends:
        points += [(left, y), (right, y)]
    return [*points, (last.x, last.y + last.height / 2 + lower)]
