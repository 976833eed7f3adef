"""Fixtures for tests of keys."""

from __future__ import annotations

from pathlib import Path

import pytest
from hosts.conftest import world
from hosts.host import Host
from hosts.world import World

from rosz.security import Authority

__all__ = ("authority", "pair", "world")


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    """A new authority."""
    return Authority.create(tmp_path / "keys")


@pytest.fixture
def pair(world: World, authority: Authority) -> tuple[Host, Host]:
    """A robot and a laptop, both with keys."""
    robot, laptop = world.hosts("robot", "laptop")
    for host in (robot, laptop):
        host.variables["ROSZ_KEYS"] = str(authority.add(host.name))
    return robot, laptop
