"""The command line of ROS 2: what it prints is what ROS 2's own command printed."""

from __future__ import annotations

import re
import shlex
from typing import Any

import pytest

from .conftest import RECORDED, Ros2

MASKS = (
    (r"_ros2cli_\d+", "_ros2cli_PID"),
    (r"GID: [0-9a-f.]{47}$", "GID: GID"),
    (r"accepted with ID: [0-9a-f]{32}$", "accepted with ID: GOAL"),
)
UNORDERED = ("ros2 interface package",)
"""What ROS 2 prints in the order of a set."""
BEFORE = {"ros2 param dump /talker": "param set /talker level 5"}
"""What was done before a line."""


def masked(text: str) -> str:
    for pattern, mask in MASKS:
        text = re.sub(pattern, mask, text, flags=re.MULTILINE)
    return text


@pytest.mark.parametrize("row", RECORDED["lines"], ids=lambda row: str(row["line"]))
def test_recorded_line(world: Ros2, row: dict[str, Any]) -> None:
    _, *words = shlex.split(row["line"])
    if row["line"] in BEFORE:
        assert world(*BEFORE[row["line"]].split()).out == "Set parameter successful\n"
    code, out, err = world(*words)
    lines, expected = masked(out).split("\n"), row["stdout"].split("\n")
    if row["line"].startswith(UNORDERED):
        lines, expected = sorted(lines), sorted(expected)
    assert (code, lines, err) == (row["exit"], expected, row["stderr"])


def test_the_parameter_that_no_node_changes(world: Ros2) -> None:
    name = "start_type_description_service"
    assert world("param", "set", "/talker", name, "false") == (
        0,
        "",
        f"Setting parameter failed: Trying to set a read-only parameter: {name}.\n",
    )
    described = world("param", "describe", "/talker", name).out.splitlines()
    assert described[1:] == ["  Type: boolean", "  Constraints:", "    Read only: true"]


def test_a_list_imports_nothing_slow(world: Ros2) -> None:
    code = """
    import sys
    from rosz.cli.main import run
    run(["ros2", "topic", "list"])
    print([name for name in ("typer", "yaml", "numpy", "rosz.node") if name in sys.modules])
    """
    program = world.network.program(code)
    assert program.exit_code() == 0
    assert "/chatter" in program.lines
    assert program.lines[-1] == "[]"
