"""What commands print, on both streams, and their exit codes, in a world of three nodes or none."""

from __future__ import annotations

import pytest

from .cases import ALONE, AMONG_NODES
from .golden import check, check_files
from .world import GoldenWorld

CASES = ALONE | AMONG_NODES


@pytest.mark.parametrize("name", CASES)
def test_output(name: str) -> None:
    with GoldenWorld(nodes=name in AMONG_NODES) as world:
        check(f"output/{name}.txt", "".join(map(world.answer, CASES[name].splitlines())))


def test_every_file_is_of_a_case() -> None:
    check_files("output", [f"{name}.txt" for name in CASES])
