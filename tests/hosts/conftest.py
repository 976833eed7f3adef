"""What tests on several hosts share: see `world.World`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from hosts.world import World, why_not


@pytest.fixture
def world() -> Iterator[World]:
    """A world for one test alone."""
    reason = why_not()
    if reason:
        pytest.skip(reason)
    with World() as made:
        yield made
