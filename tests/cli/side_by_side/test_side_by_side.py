"""rosz's commands beside ROS 1's: the same nodes, the same lines, the same answers.

What ROS 1 answers is recorded in ``ros1.json``, so that the comparison needs no ROS 1; where ROS 1
is installed, the record is held against it. ``ROSZ_TEST_RECORD=1`` writes it anew.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import pytest
from network import repeats

from .cases import COMMANDS, DIFFERENCES, INTERRUPTED
from .normal import normal
from .worlds import Outcome, Ros1, Rosz, World

RECORD = Path(__file__).with_name("ros1.json")
_AT_A_TIME = 4
_NODES = ("topic echo", "topic hz", "topic bw", "topic delay", "topic pub", "service call")
_STATEFUL = "param "
"""Commands that build on those before them."""


def answers(world: World, lines: Sequence[str]) -> list[tuple[str, Outcome]]:
    """Return what a world answers to lines; one may be there twice, and mean something else then.

    Most of their time commands wait, so several run at a time: first those that only look, then
    those that are nodes themselves, which the others would see.
    """
    found: dict[int, Outcome] = {}

    def run(numbers: Sequence[int]) -> None:
        for number in numbers:
            line = lines[number]
            found[number] = normal(line, world.run(line, interrupt=line in INTERRUPTED))

    looking = [n for n, line in enumerate(lines) if not line.startswith((*_NODES, _STATEFUL))]
    nodes = [n for n, line in enumerate(lines) if line.startswith(_NODES)]
    in_order = [n for n, line in enumerate(lines) if line.startswith(_STATEFUL)]
    with world, ThreadPoolExecutor(_AT_A_TIME) as pool:
        list(pool.map(run, [in_order, *([n] for n in looking)]))
        list(pool.map(run, [[n] for n in nodes]))
    return [(line, found[number]) for number, line in enumerate(lines)]


def recorded() -> list[tuple[str, Outcome]]:
    return msgspec.json.decode(RECORD.read_bytes(), type=list[tuple[str, Outcome]])


def report(line: str, ours: Outcome, theirs: Outcome) -> str:
    return f"--- {line}\nros1 ({theirs.code}):\n{theirs.out}\nrosz ({ours.code}):\n{ours.out}\n"


def test_rosz_answers_as_ros_1() -> None:
    pairs = list(zip(answers(Rosz(), COMMANDS), recorded(), strict=True))
    assert [theirs[0] for _, theirs in pairs] == COMMANDS, "record anew: ROSZ_TEST_RECORD=1"
    wrong = [
        report(line, ours, theirs)
        for (line, ours), (_, theirs) in pairs
        if ours != theirs and line not in DIFFERENCES
    ]
    assert not wrong, "\n".join(wrong)
    alike = {line for (line, ours), (_, theirs) in pairs if ours == theirs}
    assert not alike & set(DIFFERENCES), "these no longer differ"


@pytest.mark.ros1
def test_ros_1_answers_as_recorded() -> None:
    if os.environ.get("ROSZ_TEST_RECORD"):
        found = answers(Ros1(), COMMANDS)
        RECORD.write_bytes(msgspec.json.format(msgspec.json.encode(found), indent=1) + b"\n")
        return
    step = repeats(4, 1)
    chosen = [
        entry
        for number, entry in enumerate(recorded())
        if number % step == 0 or entry[0].startswith(_STATEFUL)
    ]
    now = answers(Ros1(), [line for line, _ in chosen])
    wrong = [
        report(line, ours, theirs)
        for (line, ours), (_, theirs) in zip(now, chosen, strict=True)
        if ours != theirs
    ]
    assert not wrong, "\n".join(wrong)


def test_every_difference_is_of_a_command() -> None:
    assert set(DIFFERENCES) <= set(COMMANDS)
