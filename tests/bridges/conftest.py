"""What tests of bridges share."""

from __future__ import annotations

import logging

import pytest


@pytest.fixture(autouse=True)
def reasons(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """Show with a failure why the server of websockets ended a connection."""
    monkeypatch.setattr(logging.getLogger("rosz.bridges.clients"), "propagate", True)
    caplog.set_level(logging.DEBUG, "rosz.bridges.clients")
