from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from oracle import Worker, require

from .fleet import Fleet
from .network import Network


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


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    with TemporaryDirectory(prefix="rosz") as folder:
        fleet = Fleet(Path(folder))
        yield fleet
        fleet.close()
