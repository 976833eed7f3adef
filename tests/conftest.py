"""What tests on the network share: see `network.Network`."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from network import Network


def pytest_configure() -> None:
    """Take Ctrl-C even in the background of a script, where the shell has it ignored.

    What is started would inherit that, and not end when told to.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def network() -> Iterator[Network]:
    """A network for one test alone."""
    made = Network()
    yield made
    made.close()
