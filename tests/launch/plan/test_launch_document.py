"""The XML of launch files, with positions."""

from __future__ import annotations

import pytest

from rosz.errors import LaunchFileError
from rosz.launch.plan.document import parse

TEXT = """<?xml version="1.0"?>
<!DOCTYPE launch [<!ENTITY who "marvin">]>
<launch>
  <node name="a&amp;b$(arg x)"
    pkg='é' args="1 &who;
      2" ns = "n"/><!-- a comment --><param name=">"/>
  <rosparam>a: 1
b: <!-- x -->3
  c: 4</rosparam>
</launch>
"""


def test_tags_know_line_and_column() -> None:
    launch = parse("f", TEXT.encode()).launch
    assert [(tag.tag, *tag.locate()) for tag in launch.children] == [
        ("node", 4, 3),
        ("param", 6, 38),
        ("rosparam", 7, 3),
    ]


@pytest.mark.parametrize(
    ("attribute", "index", "place"),
    [
        ("name", 0, (4, 15)),
        ("name", 1, (4, 16)),
        ("name", 3, (4, 22)),
        ("pkg", 0, (5, 10)),
        ("args", 0, (5, 19)),
        ("ns", 0, (6, 16)),
        ("absent", 0, (4, 3)),
    ],
)
def test_attributes_know_line_and_column(
    attribute: str, index: int, place: tuple[int, int]
) -> None:
    node = parse("f", TEXT.encode()).launch.children[0]
    assert node.locate(attribute, index) == place


def test_values_are_normalised_as_in_xml() -> None:
    node = parse("f", TEXT.encode()).launch.children[0]
    assert node.attributes == {
        "name": "a&b$(arg x)",
        "pkg": "é",
        "args": "1 marvin       2",
        "ns": "n",
    }


@pytest.mark.parametrize(
    ("line", "column", "place"), [(0, 0, (7, 13)), (0, 3, (7, 16)), (1, 3, (8, 14)), (2, 2, (9, 3))]
)
def test_text_knows_line_and_column(line: int, column: int, place: tuple[int, int]) -> None:
    rosparam = parse("f", TEXT.encode()).launch.children[2]
    assert rosparam.text == "a: 1\nb: 3\n  c: 4"
    assert rosparam.locate_text(line, column) == place


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1", "us-ascii"])
def test_any_encoding_is_read(encoding: str) -> None:
    declared = encoding.removesuffix("-sig")
    text = f'<?xml version="1.0" encoding="{declared}"?>\n<launch><node name="a"/></launch>'
    node = parse("f", text.encode(encoding)).launch.children[0]
    assert node.attributes == {"name": "a"}
    assert node.locate("name")[0] == 2


def test_columns_count_characters_not_bytes() -> None:
    launch = parse("f", '<launch><!-- äöü --><x y="ß" z="1"/></launch>'.encode()).launch
    assert launch.children[0].locate() == (1, 21)
    assert launch.children[0].locate("z") == (1, 33)


def test_prefixes_are_part_of_names() -> None:
    text = b'<launch xmlns="urn:d" xmlns:x="urn:x"><x:a x:b="1" c="2"/><d/></launch>'
    children = parse("f", text).launch.children
    assert [child.tag for child in children] == ["x:a", "d"]
    assert children[0].attributes == {"x:b": "1", "c": "2"}


@pytest.mark.parametrize(
    ("entity", "reason"),
    [
        ('a SYSTEM "file:///etc/passwd"', "entity 'a' is external"),
        ('% a "x"', "entity 'a' is external"),
        ('a "' + "x" * 5000 + '"', "entity 'a' is longer than 4096 characters"),
        ('b "1"><!ENTITY a "&b;&b;"', "entity 'a' refers to entity 'b'"),
    ],
)
def test_entities_that_could_explode_are_refused(entity: str, reason: str) -> None:
    text = f"<!DOCTYPE launch [<!ENTITY {entity}>]><launch/>"
    with pytest.raises(LaunchFileError, match=reason) as caught:
        parse("f", text.encode())
    assert caught.value.line == 1


def test_deep_nesting_is_read() -> None:
    depth = 20_000
    launch = parse(
        "f", b"<launch>" + b"<group>" * depth + b"</group>" * depth + b"</launch>"
    ).launch
    assert launch.children[0].tag == "group"
