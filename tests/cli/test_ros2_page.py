"""The way from ROS 1 to ROS 2 on the manual's page: its node runs, and its commands print that."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

from network import Network, eventually

from .command import ROOT, rosz

PAGE = (ROOT / "rosz" / "share" / "manual" / "ros2.md").read_text()
BLOCKS = [
    dedent(found[0]).lstrip() for found in re.finditer(r"(?m)(?:^    .*\n|^\n(?=    ))+", PAGE)
]


def test_a_node_on_its_way(network: Network, tmp_path: Path) -> None:
    (script,) = (block for block in BLOCKS if block.startswith("import rclpy"))
    (session,) = (block for block in BLOCKS if block.startswith("$ "))
    (tmp_path / "talker.py").write_text(script)
    network.run("-m", "rosz.ros1", str(tmp_path / "talker.py"))
    variables = {
        "ROSZ_RENDEZVOUS": network.rendezvous,
        "ROS_DOMAIN_ID": str(network.domain),
    }

    def output(line: str) -> str:
        command, *words = re.findall(r"\S+", line)
        assert command == "rosz"
        done = rosz(tmp_path, *words, variables=variables)
        return f"{done.stdout}{done.stderr}" if done.returncode == 0 else ""

    eventually(lambda: "/chatter" in output("rosz topic list"), "the node is there")
    steps = re.findall(r"^\$ (.*)\n((?:[^$].*\n)*)", session, re.MULTILINE)
    assert len(steps) == 4
    for line, printed in steps:
        shown = output(line)
        assert printed in shown if line == "rosz node list" else shown == printed, (line, shown)
