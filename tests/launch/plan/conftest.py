"""One real roslaunch per test process, and rosz with the same packages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from .roslaunch_oracle import Roslaunch, Rosz, environment

PACKAGES = Path(__file__).with_name("packages")


@pytest.fixture(scope="session")
def environ(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return environment(PACKAGES, tmp_path_factory.mktemp("ros_home"))


@pytest.fixture(scope="session")
def roslaunch(environ: dict[str, str]) -> Iterator[Roslaunch]:
    found = Roslaunch(environ)
    yield found
    found.close()


@pytest.fixture(scope="session")
def rosz(environ: dict[str, str]) -> Rosz:
    return Rosz(environ)
