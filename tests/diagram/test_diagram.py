"""Pictures of nodes and topics: what they show, their layout, and the languages of files."""

from __future__ import annotations

import random
import time
import xml.etree.ElementTree as ET

import pytest

from rosz.diagram import (
    PictureOptions,
    labels_of,
    make_picture,
    write_dot,
    write_mermaid,
    write_svg,
)
from rosz.diagram.layers import lay_out
from rosz.errors import UsageError
from rosz.wire import Kind, Token

STRING = "std_msgs/msg/String"


def tokens(*lines: str) -> list[Token]:
    """Return tokens from lines such as ``/talker > /chatter`` and ``/listener < /chatter``."""
    found = []
    ids: dict[str, int] = {}
    for number, line in enumerate(lines, 100):
        node, sign, topic = line.split()
        node_id = ids.setdefault(node, len(ids))
        namespace, _, name = node.rpartition("/")
        kind = Kind.PUBLISHER if sign == ">" else Kind.SUBSCRIPTION
        found.append(
            Token(
                0,
                "aa",
                node_id,
                number,
                kind,
                namespace or "/",
                name,
                name=topic,
                type_name=STRING,
            )
        )
    return found


CHATTER = tokens(
    "/talker > /chatter",
    "/listener < /chatter",
    "/arm/driver > /arm/state",
    "/talker > /rosout",
    "/talker > /unheard",
    "/listener < /unsent",
    "/rqt_plot_12 < /chatter",
)


def arrows(**options: object) -> set[tuple[str, str]]:
    picture = make_picture(CHATTER, PictureOptions(**options))  # type: ignore[arg-type]
    return {(one.start, one.end) for one in picture.arrows}


def test_pictures_show_what_rqt_graph_shows() -> None:
    assert arrows() == {("node:/talker", "node:/listener")}
    assert arrows(content="active") == {
        ("node:/talker", "topic:/chatter"),
        ("topic:/chatter", "node:/listener"),
    }
    everything = arrows(content="all")
    assert ("node:/talker", "topic:/unheard") in everything
    assert ("topic:/unsent", "node:/listener") in everything
    assert not any("rosout" in end or "rqt" in end for ends in everything for end in ends)
    assert ("node:/talker", "topic:/rosout") in arrows(content="all", hide_debug=False)
    assert ("topic:/unsent", "node:/listener") not in arrows(content="all", hide_dead_sinks=True)
    assert ("node:/talker", "topic:/unheard") not in arrows(content="all", hide_leaves=True)
    assert arrows(content="all", topics="/chat*, -/chatter") == set()
    assert arrows(nodes="/talker") == set()


def test_boxes_without_arrows_and_groups_are_options() -> None:
    names = {box.name: box.group for box in make_picture(CHATTER, PictureOptions(group=1)).boxes}
    assert names == {"/talker": "", "/listener": "", "/arm/driver": "/arm"}
    connected = make_picture(CHATTER, PictureOptions(hide_unconnected=True))
    assert [box.name for box in connected.boxes] == ["/listener", "/talker"]


def test_a_wrong_choice_is_an_error() -> None:
    with pytest.raises(UsageError, match="'most' is not shown; expected nodes, active, all"):
        make_picture([], PictureOptions(content="most"))  # type: ignore[arg-type]


def many(nodes: int, topics: int, seed: int) -> list[Token]:
    """Return nodes and topics that are joined at random, also in circles."""
    chance = random.Random(seed)
    lines = []
    for topic in range(topics):
        lines.append(f"/n{chance.randrange(nodes)} > /t{topic}")
        lines += [f"/n{chance.randrange(nodes)} < /t{topic}" for _ in range(2)]
    return tokens(*lines)


@pytest.mark.parametrize("seed", range(5))
def test_boxes_never_overlap_and_arrows_join_them(seed: int) -> None:
    picture = make_picture(many(20, 40, seed), PictureOptions(content="all"))
    layout = lay_out(picture)
    places = list(layout.places.values())
    for number, one in enumerate(places):
        assert one.x >= 0
        assert one.y >= 0
        assert one.x + one.width <= layout.width
        assert one.y + one.height <= layout.height + 0.001
        for other in places[:number]:
            apart = (
                one.x + one.width <= other.x
                or other.x + other.width <= one.x
                or one.y + one.height <= other.y + 0.001
                or other.y + other.height <= one.y + 0.001
            )
            assert apart, f"{one.box.key} lies on {other.box.key}"
    for arrow, path in zip(picture.arrows, layout.paths, strict=True):
        for end, (x, y) in ((arrow.start, path[0]), (arrow.end, path[-1])):
            place = layout.places[end]
            assert place.x <= x <= place.x + place.width
            assert place.y <= y <= place.y + place.height


def test_a_chain_has_one_layer_for_each_box() -> None:
    chain = tokens("/a > /x", "/b < /x", "/b > /y", "/c < /y", "/c > /z", "/a < /z")
    layout = lay_out(make_picture(chain, PictureOptions()))
    left = {place.box.name: place.x for place in layout.places.values()}
    assert sorted(left, key=left.__getitem__) in (
        ["/a", "/b", "/c"],
        ["/b", "/c", "/a"],
        ["/c", "/a", "/b"],
    )


def test_a_hundred_nodes_and_three_hundred_topics_are_drawn_in_time() -> None:
    picture = make_picture(many(100, 300, 1), PictureOptions(content="all"))
    began = time.process_time()
    write_svg(picture)
    assert time.process_time() - began < 30  # 0.4 s on the machine of the figures


def test_pictures_are_written_in_each_language() -> None:
    odd = tokens('/a"b > /x<y', "/c&d < /x<y")
    picture = make_picture(odd, PictureOptions(content="all"))
    root = ET.fromstring(write_svg(picture, {"/x<y": "3 Hz"}))
    assert {one.get("data-key") for one in root.iter() if one.get("data-key")} == {
        'node:/a"b',
        "node:/c&d",
        "topic:/x<y",
    }
    labels = {one.get("data-arrow"): one.text or "" for one in root.iter() if one.get("data-arrow")}
    numbered = enumerate(labels_of(picture, {"/x<y": "3 Hz"}))
    assert labels == {str(number): text for number, text in numbered}
    assert "3 Hz" in labels.values()
    assert '"node:/a\\"b" -> "topic:/x<y";' in write_dot(picture)
    assert 'n0(["/a#quot;b"])' in write_mermaid(picture)
    empty = make_picture([], PictureOptions())
    assert ET.fromstring(write_svg(empty)).tag.endswith("svg")
    assert write_dot(empty) == "digraph graphname {\n  rankdir=LR;\n}\n"
