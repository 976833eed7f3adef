"""What tests of keys share."""

from __future__ import annotations

from pathlib import Path

import pytest
from hosts.conftest import world

from rosz.security.authority import Authority

__all__ = ("authority", "world")


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    """A new authority."""
    return Authority.create(tmp_path / "keys")
