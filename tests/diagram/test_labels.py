"""Labels of arrows: none covers another one, and each is on its arrow."""

from __future__ import annotations

import re
from itertools import combinations

from rosz.diagram import Picture, write_svg
from rosz.diagram.labels import place_labels
from rosz.diagram.picture import Arrow, Box

_LABEL = re.compile(r'<text data-arrow="(\d+)"( class="crowded")? x="(\d+)" y="(\d+)">([^<]*)<')
_LETTER, _HEIGHT = 6.0, 11.0


def star(count: int) -> Picture:
    """Return a node that publishes many topics, which another one publishes too."""
    topics = [f"/t{number}" for number in range(count)]
    boxes = [Box(f"node:/{name}", f"/{name}", "node") for name in ("one", "other")]
    boxes += [Box(f"topic:{name}", name, "topic") for name in topics]
    arrows = [Arrow(box.key, f"topic:{name}", (name,)) for box in boxes[:2] for name in topics]
    return Picture(tuple(boxes), tuple(arrows))


def test_labels_of_arrows_that_leave_one_box_do_not_overlap() -> None:
    picture = star(12)
    svg = write_svg(picture, {f"/t{number}": f"{number + 10} Hz" for number in range(12)})
    found = _LABEL.findall(svg)
    assert len(found) == len(picture.arrows)
    shown = [(int(x), int(y), len(text)) for _, crowded, x, y, text in found if not crowded]
    assert len(shown) >= len(picture.arrows) * 0.8
    for (x, y, count), (other_x, other_y, other_count) in combinations(shown, 2):
        apart = abs(x - other_x) >= (count + other_count) / 2 * _LETTER
        assert apart or abs(y - other_y) >= _HEIGHT, svg


def test_a_label_without_room_waits_until_one_points_at_its_arrow() -> None:
    path = [(0.0, 0.0), (70.0, 0.0)]
    places = place_labels([path] * 3, [10, 10, 0])
    assert [has_room for *_, has_room in places] == [True, False, True]
    assert all(0 <= x <= 70 and y == 0 for x, y, _ in places)
    loop = [(62.0, 20.0), (62.0, 6.0), (38.0, 6.0), (38.0, 20.0)]
    assert place_labels([loop], [5]) == [(50.0, 6.0, True)]
