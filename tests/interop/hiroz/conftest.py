"""Fixtures of tests beside hiroz."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from cli.shell import Shell

from .city import WAYS, City, Peer


@pytest.fixture(params=WAYS)
def city(request: pytest.FixtureRequest) -> Iterator[City]:
    """A network in each of the ways."""
    made = City(request.param)
    made.begin()
    yield made
    made.close()


@pytest.fixture
def peer(city: City) -> Peer:
    """A node of hiroz on it."""
    return city.peer()


@pytest.fixture
def town() -> Iterator[City]:
    """A network without a router yet, for what happens around the start of one."""
    made = City("core-peer")
    yield made
    made.close()


@pytest.fixture
def shell(city: City, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Shell:
    """A shell on it."""
    return Shell(city, monkeypatch, capsys)
