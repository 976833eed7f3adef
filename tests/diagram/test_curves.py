"""The paths of arrows in SVG."""

from __future__ import annotations

import re
from itertools import pairwise

from rosz.diagram import Picture, write_svg
from rosz.diagram.layers import lay_out
from rosz.diagram.picture import Arrow, Box

_COMMAND = re.compile(r"([MHc])([^MHc]*)")


def end_of(drawn: str) -> tuple[float, float]:
    """Return where a path ends; each of its curves is level at both ends."""
    x = y = 0.0
    for command, text in _COMMAND.findall(drawn):
        numbers = [float(one) for one in text.split()]
        if command == "M":
            x, y = numbers
        elif command == "H":
            (x,) = numbers
        else:
            across, level, back, along, right, down = numbers
            assert (level, back, along) == (0, across, down)
            x, y = x + right, y + down
    return x, y


def test_paths_are_short_and_end_at_their_boxes() -> None:
    names = [f"node:/n{number}" for number in range(60)]
    boxes = tuple(Box(key, key.removeprefix("node:"), "node") for key in names)
    arrows = [Arrow(one, other, ("/t",)) for one, other in pairwise(names)]
    arrows += [Arrow(names[0], other, ("/far",)) for other in names[2:]]
    picture = Picture(boxes, tuple(arrows))
    drawn = re.findall(r'<path d="(M[^"]*)" marker-end', write_svg(picture))
    paths = lay_out(picture, 72.0).paths
    assert len(drawn) == len(paths) == len(arrows)
    for text, path in zip(drawn, paths, strict=True):
        assert end_of(text)[1] == round(path[-1][1])
    assert sum(map(len, drawn)) < 15 * sum(map(len, paths))
