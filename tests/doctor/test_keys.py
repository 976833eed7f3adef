"""What is well between machines that need keys is not found at fault."""

from __future__ import annotations

from pathlib import Path

import pytest
from hosts.conftest import world
from hosts.world import World
from network import eventually

from rosz.security import Authority

__all__ = ("world",)


@pytest.mark.parametrize("control", [True, False])
def test_a_machine_with_keys(world: World, tmp_path: Path, control: bool) -> None:
    authority = Authority.create(tmp_path / "keys")
    robot, laptop = world.hosts("robot", "laptop")
    for host in (robot, laptop):
        host.variables["ROSZ_KEYS"] = str(authority.add(host.name))
    rules = f"laptop: {{subscribe: ['/**'], control: {str(control).lower()}}}\n"
    Path(robot.variables["ROSZ_KEYS"], "rules.yaml").write_text(rules)
    laptop.variables["ROSZ_CONNECT"] = "tcp/robot:7447"
    robot.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core")
    robot.rosz("run", "rosz_tutorials", "publisher.py", "__name:=publisher")
    eventually(lambda: laptop.lists("/publisher"), "the node")
    looked = laptop.rosz("doctor", "--wait", "0")
    looked.exit_code(60)
    assert "nobody-listens" not in looked.output
    assert "unreachable-node" not in looked.output
    assert ("WARNING silent-machine" in looked.output) is not control
