from __future__ import annotations

import pytest
from network import Network

from .rospy_programs import Printed, run


@pytest.fixture
def printed(network: Network) -> Printed:
    """Run a program, and return its lines."""
    return lambda script: run(network, script)
