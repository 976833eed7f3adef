"""What tests on the network share: see `network.Network`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from network import Network


@pytest.fixture
def network() -> Iterator[Network]:
    """A network for one test alone."""
    made = Network()
    yield made
    made.close()
