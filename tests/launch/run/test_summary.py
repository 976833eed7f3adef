"""The summary of a plan at the start, and of exit codes at the end."""

from __future__ import annotations

from typing import Any

import pytest

from rosz.launch.plan.model import MachinePlan, Plan
from rosz.launch.run.runner import describe_plan
from rosz.launch.run.supervisor import describe_exit

from .in_thread import HERE, param, shell


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (1, "1"),
        (1.0, "1.0"),
        (True, "True"),
        ("short", "short"),
        ("x" * 20, "x" * 20),
        ("x" * 21, "x" * 17 + "..."),
        ([1, 2.5], "[1, 2.5]"),
        ("noetic\n", "noetic"),
        ("two\nlines", "<...>"),
        ("na\xefve", "<...>"),
        ("x ", "x "),
        ("tab\t", "tab"),
        (b"ab", "b'ab'"),
    ],
)
def test_values_are_shortened_as_in_roslaunch(value: Any, shown: str) -> None:
    assert f"\n * /p: {shown}\n" in describe_plan(Plan(params=(param("/p", value),)))


def test_sections() -> None:
    machine = MachinePlan("base", "robot1", "", 22, "", "", 10.0, True, HERE)
    plan = Plan(
        clear=("/b", "/a"),
        params=(param("/z", 1), param("/y", 2)),
        machines=(machine,),
        nodes=(shell("n2", "x"), shell("n1", "x", namespace="/b"), shell("n1", "y")),
    )
    assert describe_plan(plan, machines=True) == (
        "\nSUMMARY\n========\n\nCLEAR PARAMETERS\n * /a/\n * /b/\n"
        "\nPARAMETERS\n * /y: 2\n * /z: 1\n"
        "\nMACHINES\n * base\n\nNODES\n  /\n    n1 (sh -c y)\n    n2 (sh -c x)\n"
        "  /b/\n    n1 (sh -c x)\n"
    )
    assert "MACHINES" not in describe_plan(plan)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0, "ended with exit code 0"),
        (255, "ended with exit code 255"),
        (-9, "was ended by SIGKILL"),
        (-250, "was ended by signal 250"),
        (None, "gave no exit code"),
    ],
)
def test_exit_codes(code: int | None, text: str) -> None:
    assert describe_exit(code) == text
