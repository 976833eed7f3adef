"""The names of containers in launch files."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rosz.errors import LaunchFileError
from rosz.launch.plan import LaunchText, Plan, SystemContext, plan
from rosz.packages import PackageIndex

NODE = '<node pkg="p" type="t.py" name="{}"/>'


def read(text: str) -> Plan:
    context = SystemContext(PackageIndex(()), {}, Path("/"), lambda base: base)
    return plan([LaunchText(f"<launch>{text}</launch>")], {}, context)


def test_a_group_names_the_container_of_its_nodes() -> None:
    found = read(
        f'<group ns="robot"><group container="box" by_reference="true">{NODE.format("a")}'
        f'<group container="/other">{NODE.format("b")}</group></group>{NODE.format("c")}</group>'
    )
    assert [(node.full_name, node.container, node.by_reference) for node in found.nodes] == [
        ("/robot/a", "/robot/box", True),
        ("/robot/b", "/other", False),
        ("/robot/c", "", False),
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (f'<group container="a">{NODE.format("a")}</group>', "has the name of the node at"),
        (f'<group container="">{NODE.format("a")}</group>', "'container' is ''; expected a name"),
        (f'<group container="~x">{NODE.format("a")}</group>', "'container' is '~x'"),
        (f'<group container="a b">{NODE.format("a")}</group>', "character ' ' at position 2"),
        (f'<group by_reference="true">{NODE.format("a")}</group>', "needs 'container'"),
        (
            f'<group container="box">{NODE.format("a")}{NODE.format("a")}</group>',
            "two nodes are named '/a'",
        ),
    ],
)
def test_what_is_wrong_has_a_place(text: str, problem: str) -> None:
    with pytest.raises(LaunchFileError, match=rf":1:\d+.*{re.escape(problem)}"):
        read(text)
