"""Debian's command-line tools with rosz as their master, beside what they say of a real roscore.

The talker is a node of rosz and the listener one of ROS 1. What the tools say of a roscore is the
record of ``tests/cli/side_by_side``; what they do to nodes and bags is in ``commands.json``, which
``ROSZ_TEST_RECORD=1`` writes anew.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Self

import msgspec
import pytest
from cli.side_by_side.test_side_by_side import answers, recorded, report
from cli.side_by_side.worlds import Outcome, Ros1, World
from network import TIMEOUT, eventually, repeats
from oracle import PYTHON

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_ROOT = Path(__file__).parents[3]
_NODES = _ROOT / "tests" / "cli" / "side_by_side" / "nodes.py"
_RECORD = Path(__file__).with_name("commands.json")
_TIMEOUT = 2 * TIMEOUT
_ABOUT_MASTERS = ("topic ", "service ", "node ", "param ")
_IN_ORDER = "param delete /nowhere"
"""The last of the commands that build on those before them."""

_KILL = "node kill /talker"
STEPS = """\
node list
wtf
node machine
topic info /rosout_agg
bag record -O a.bag --limit 20 /chatter
bag info -y -k types a.bag
bag info -y -k messages a.bag
bag play -q a.bag
run topic_tools throttle
node kill /talker
node list
topic list
node kill /nowhere
node kill -a
""".splitlines()
"""Commands that do something, in turn."""

_CHANCE = (
    (re.compile(r"http://127\.0\.0\.1:\d+/(?:node/\w+/)?"), "<place>"),
    (re.compile(r"\x1b\[[\d;]*m"), ""),
    (re.compile(r"\[\d+\.\d+\]"), "[<now>]"),
    (re.compile(r"^.*/(?:get_loggers|set_logger_level)\n", re.MULTILINE), ""),
)


class Door(Ros1):
    """ROS 1's tools and one of its nodes, and rosz as their master."""

    def __enter__(self) -> Self:
        theirs = self.environ
        ours = theirs | {
            "PATH": os.environ["PATH"],
            "PYTHONPATH": str(_ROOT),
            "ROSZ_RENDEZVOUS": f"unixsock-stream/{self.folder}/z.sock",
        }
        self.environ = ours
        core = (sys.executable, "-m", "rosz", "core", "--ros1", "-p", str(self._port))
        self.start(*core).wait_for("started core", _TIMEOUT)
        self.start(sys.executable, "-m", "rosz.ros1", str(_NODES), "talker").wait_for(
            "ready", _TIMEOUT
        )
        self.environ = theirs
        self.start(PYTHON, str(_NODES), "listener").wait_for("ready", _TIMEOUT)
        info = "node info /listener"
        eventually(lambda: "c: /chatter" in self.run(info).out, "a connection", _TIMEOUT)
        return self


def _is_gone(world: World, node: str) -> bool:
    return node not in world.run("node list").out.split()


def _do(world: Callable[[], World]) -> list[tuple[str, Outcome]]:
    found = []
    with world() as made:
        for line in STEPS:
            outcome = made.run(line)
            if line == _KILL:
                gone = partial(_is_gone, made, line.split()[-1])
                eventually(gone, "the node has ended", _TIMEOUT)
            out = outcome.out
            for pattern, text in _CHANCE:
                out = pattern.sub(text, out)
            found.append((line, Outcome(outcome.code, out.strip("\n"), "")))
    return found


def test_the_tools_answer_as_with_a_roscore() -> None:
    known = [entry for entry in recorded() if entry[0].startswith(_ABOUT_MASTERS)]
    step = repeats(4, 1)
    in_order = [entry for entry in known if entry[0].startswith("param ")]
    if step > 1:
        in_order = in_order[: [line for line, _ in in_order].index(_IN_ORDER) + 1]
    chosen = [entry for entry in known if not entry[0].startswith("param ")][::step] + in_order
    now = answers(Door(), [line for line, _ in chosen])
    wrong = [
        report(line, ours, theirs)
        for (line, ours), (_, theirs) in zip(now, chosen, strict=True)
        if ours != theirs
    ]
    assert not wrong, "\n".join(wrong)


def test_the_tools_do_as_with_a_roscore() -> None:
    if os.environ.get("ROSZ_TEST_RECORD"):
        _RECORD.write_bytes(msgspec.json.format(msgspec.json.encode(_do(Ros1)), indent=1) + b"\n")
    known = msgspec.json.decode(_RECORD.read_bytes(), type=list[tuple[str, Outcome]])
    wrong = [
        report(line, ours, theirs)
        for (line, ours), (_, theirs) in zip(_do(Door), known, strict=True)
        if ours != theirs
    ]
    assert not wrong, "\n".join(wrong)
