"""The doctor of a test, on the test's own network."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from network import Network

from rosz.doctor import Examination, Finding, examine

Doctor = Callable[..., dict[str, Finding]]


@pytest.fixture
def doctor(network: Network) -> Doctor:
    """Look at the network of the test, and return what is found by name."""

    def look(*, listen: float = 0.0, least_free: int = 0, **settings: Any) -> dict[str, Finding]:
        examination = Examination(
            environment=network.environment(**settings),
            listen=listen,
            memory=network.folder,
            least_free=least_free,
        )
        return {finding.name: finding for finding in examine(examination)}

    return look
