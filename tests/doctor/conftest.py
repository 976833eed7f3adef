"""The doctor of a test, on the test's own network."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.doctor import Examination, Finding, examine

Doctor = Callable[..., dict[str, Finding]]
_LIMITS = (
    "replies._NODE_TIMEOUT",
    "replies._TIMEOUT",
    "replies._ADMIN_SECONDS",
    "tokens._REPLY_TIMEOUT",
)


def be_patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the doctor wait for the answers of a busy machine."""
    for limit in _LIMITS:
        monkeypatch.setattr(f"rosz.doctor.{limit}", TIMEOUT)


@pytest.fixture
def doctor(network: Network, monkeypatch: pytest.MonkeyPatch) -> Doctor:
    """Look at the network of the test, and return what is found by name."""

    def look(
        *, listen: float = 0.0, least_free: int = 0, somebody_hangs: bool = False, **settings: Any
    ) -> dict[str, Finding]:
        examination = Examination(
            environment=network.environment(**settings),
            listen=listen,
            memory=network.folder,
            least_free=least_free,
        )
        with monkeypatch.context() as patch:
            if not somebody_hangs:
                be_patient(patch)
            return {finding.name: finding for finding in examine(examination)}

    return look
