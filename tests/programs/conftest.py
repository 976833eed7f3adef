"""Fixtures of the programs of ROS 1 packages."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from ros1.programs.runners import Ros


@pytest.fixture(scope="session")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros]:
    """A real roscore, which the comparing tests of this folder share."""
    runner = Ros(tmp_path_factory.mktemp("ros"))
    yield runner
    runner.close()
