"""What the course's tests share: see `terminal.Desk`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from network import Network

from .terminal import Desk

collect_ignore = ["pub_sub", "src"]
"""The course's own packages: a program there may be called test_params.py."""


@pytest.fixture
def desk(network: Network) -> Iterator[Desk]:
    """A student's desk, on a network of its own."""
    made = Desk(network)
    yield made
    made.close()
