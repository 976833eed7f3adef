"""``fleet.yaml`` and ``--share``: what they say, and where a mistake is."""

from __future__ import annotations

import math

import pytest

from rosz.bridges.fleet import FleetPlan, SharedNames, read_plan, read_share
from rosz.errors import UsageError, YamlError

PLAN = """
as: /robot1
share: [/odom, "/camera/**@2Hz", /dock]
take: /cmd_vel
common: [/map]
frames: true
"""


def test_a_file_says_what_crosses() -> None:
    plan = read_plan(PLAN, "fleet.yaml")
    assert plan == FleetPlan(
        prefix="/robot1",
        share=(SharedNames("/odom"), SharedNames("/camera/**", 2.0), SharedNames("/dock")),
        take=("/cmd_vel",),
        common=("/map",),
        frames=True,
    )
    assert plan.shares("/dock/_action/send_goal")
    assert not plan.shares("/scan")
    assert plan.takes("/cmd_vel")
    assert (plan.rate("/camera/left/image"), plan.rate("/odom")) == (2.0, math.inf)
    assert read_plan("", "fleet.yaml") == FleetPlan()


def test_names_cross_both_ways() -> None:
    plan = read_plan(PLAN, "fleet.yaml")
    for inside, outside in (("/odom", "/robot1/odom"), ("/map", "/map")):
        assert plan.outside(inside) == outside
        assert plan.inside(outside) == inside
    assert plan.inside("/robot2/odom") is plan.inside("/robot1") is None
    # The name of a common topic belongs to that alone.
    assert FleetPlan(prefix="/r", common=("/r/x",)).outside("/x") is None


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("as: robot one", "f:1:5: 'as' is 'robot one'"),
        ("shared: /odom", "f:1:1: 'shared' is not known; did you mean 'share'"),
        ("as: /r\nshare: [/a, odom]", "f:2:13: 'odom' is not a pattern"),
        ("share: /a@0Hz", "f:1:8: '/a@0Hz' is not a pattern"),
        ("take: [[/a]]", "f:1:8: expected a name or a list of names"),
        ("frames: perhaps", "f:1:9: expected true or false"),
        ("- /odom", "f:1:1: expected a mapping of what a robot shares"),
        ("as: /a\nas: /b", "f:2:1: 'as' stands here twice"),
    ],
)
def test_errors_name_line_and_column(text: str, error: str) -> None:
    with pytest.raises(YamlError) as caught:
        read_plan(text, "f")
    assert error in str(caught.value)


def test_share_of_the_command_line() -> None:
    assert read_share("/odom, /camera/**@2.5Hz") == (
        SharedNames("/odom"),
        SharedNames("/camera/**", 2.5),
    )


@pytest.mark.parametrize(
    ("text", "wrong"), [("/a@fastHz", "'/a@fastHz'"), ("", "''"), ("/a,,/b", "''"), ("/a,", "''")]
)
def test_wrong_shares_of_the_command_line(text: str, wrong: str) -> None:
    with pytest.raises(UsageError, match=f"--share has {wrong}"):
        read_share(text)
