from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings
from oracle import Worker, require

from .network import Network

# ROSZ_EXAMPLES=20000 makes a night of it.
settings.register_profile(
    "params",
    deadline=None,
    max_examples=int(os.environ.get("ROSZ_EXAMPLES", "100")),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
settings.load_profile("params")


@pytest.fixture(scope="session")
def ros1() -> Iterator[Worker]:
    require("rosmaster", "rosparam", package="python3-rosmaster, python3-rosparam")
    worker = Worker("rosparam_calls")
    yield worker
    worker.close()


@pytest.fixture
def network() -> Iterator[Network]:
    found = Network()
    yield found
    found.close()
