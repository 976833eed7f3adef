"""The command line of a launch."""

from __future__ import annotations

import pytest

from rosz.launch.plan import LaunchArguments, parse_arguments


def test_args_and_files_are_separated() -> None:
    found = parse_arguments(["pkg", "a.launch", "x:=1", "b-c.launch", "y:= a b ", "~z/é:=2"])
    assert found == LaunchArguments(
        {"x": "1", "y": "a b", "~z/é": "2"}, "", ("pkg", "a.launch", "b-c.launch")
    )


def test_the_namespace_is_not_an_arg() -> None:
    assert parse_arguments(["__ns:=/a", "__ns:=/b", "__name:=x"]) == LaunchArguments({}, "/a")


def test_the_last_value_of_a_name_wins() -> None:
    assert parse_arguments(["x:=1", "x:=2"]).args == {"x": "2"}


@pytest.mark.parametrize(
    ("argument", "reason"),
    [
        ("x:=", "it gives no value, so a default stays"),
        ("x:=a:=b", "it contains ':=' twice"),
        ("_x:=1", "it is for a node, not for a launch"),
        ("9x:=1", "'9x' is not the name of an arg"),
        ("a-b:=1", "'a-b' is not the name of an arg"),
        (":=1", "'' is not the name of an arg"),
        ("x:=one\ntwo", "'x' is not the name of an arg"),
    ],
)
def test_words_that_roslaunch_ignores_are_warned_about(argument: str, reason: str) -> None:
    found = parse_arguments([argument])
    assert (found.args, found.rest) == ({}, ())
    assert found.warnings == (f"'{argument}' is ignored: {reason}",)
