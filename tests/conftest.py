"""Fixtures and markers of all tests.

Markers select a part of the tests: ``pytest -m hosts``, ``pytest -m "not system and not ros1"``.
``system`` (opens sessions or starts processes) and ``hosts`` (network namespaces) follow from the
fixtures of a test and its folder. ``ros1`` (compares with real ROS 1) follows from a fixture that
starts ROS 1; otherwise it is written in the file. ``pure`` are the tests of the gate's first stage:
those of `_PURE` that have none of the other marks.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import oracle
import pytest
from hypothesis import HealthCheck, settings
from network import TIMEOUT, Network

from rosz.actions import ActionClient
from rosz.graph import Graph
from rosz.message import Ros2Default
from rosz.node import Client, Context, Publisher, Subscription

# Tests give the same result on a busy machine. ROSZ_EXAMPLES=20000 takes a night.
settings.register_profile(
    "rosz",
    deadline=None,
    max_examples=int(os.environ.get("ROSZ_EXAMPLES", "100")),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
settings.load_profile("rosz")


_ROS1_DEFAULTS = pytest.StashKey[bool]()


@pytest.fixture(autouse=True)
def defaults_of_ros2(request: pytest.FixtureRequest) -> Iterator[None]:
    """ROS 2's defaults for all tests but those of ROS 1's names, whose import changes them."""
    stash = request.config.stash
    if "ros1" in request.path.parts:
        Ros2Default.ros1 = Ros2Default.ros1 or stash.get(_ROS1_DEFAULTS, False)
    yield
    stash[_ROS1_DEFAULTS] = Ros2Default.ros1 or stash.get(_ROS1_DEFAULTS, False)
    Ros2Default.ros1 = False


def pytest_configure() -> None:
    """Handle signals that the shell ignores in the background of a script, or with nohup.

    Programs that tests start would inherit that, and not end when told to.
    """
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)


_HOSTS = Path(__file__).parent / "hosts"
_SYSTEM = {"course", "faults", "hosts", "interop"}
_ROS_1 = {"genpy", "ros", "ros1", "roslaunch"}
"""Fixtures that start real ROS 1."""
_PURE = ("arch", "golden/test_api.py", "idl", "interfaces", "launch/plan", "msgs", "wire")
_LONG = ("hosts", "faults", "course", "interop", "bridges", "web")
"""Folders with long tests. They begin first, so that no worker has one left at the end."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark tests by what they need, and put long ones first."""
    # Modules of tests import ROS 1's names; fixtures of modules come before those of functions.
    config.stash[_ROS1_DEFAULTS] = Ros2Default.ros1
    Ros2Default.ros1 = False
    for item in items:
        path = item.path.relative_to(_HOSTS.parent)
        folder = path.parts[0]
        if folder == _HOSTS.name:
            item.add_marker(pytest.mark.hosts)
        fixtures = set(getattr(item, "fixturenames", ()))
        if folder in _SYSTEM or "network" in fixtures:
            item.add_marker(pytest.mark.system)
        if fixtures & _ROS_1:
            item.add_marker(pytest.mark.ros1)
        marks = {mark.name for mark in item.iter_markers()}
        quick = len(path.parts) == 1 or any(path.is_relative_to(part) for part in _PURE)
        if quick and not marks & {"hosts", "ros1", "system"}:
            item.add_marker(pytest.mark.pure)
    items.sort(key=_order)


def _order(item: pytest.Item) -> int:
    folder = item.path.relative_to(_HOSTS.parent).parts[0]
    return _LONG.index(folder) if folder in _LONG else len(_LONG)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Refuse ROS 1 to tests that lack the mark."""
    oracle.marked = item.get_closest_marker("ros1") is not None


@pytest.fixture(autouse=True)
def patient_waits(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Waits for others last as long as `TIMEOUT`; the defaults are for a machine that is not busy.

    Tests that open no session see the defaults as they are.
    """
    if request.node.get_closest_marker("system") is not None:
        for wait in (Client.wait_for_service, ActionClient.wait_for_server, Subscription.get):
            monkeypatch.setattr(wait, "__defaults__", (TIMEOUT,))
        monkeypatch.setattr(Publisher.wait_for_subscribers, "__defaults__", (1, TIMEOUT))
        monkeypatch.setattr("rosz.node.client._GRACE", TIMEOUT)  # of a call for its server
        # After these, a session counts as linked to all, and what is known as complete.
        monkeypatch.setattr(Context, "MESH_TIMEOUT", TIMEOUT)
        monkeypatch.setattr("rosz.params.replica.replica._MESH_TIMEOUT", TIMEOUT)
        monkeypatch.setattr(Graph.refresh, "__defaults__", (TIMEOUT,))
        for module in ("graph", "interests"):
            monkeypatch.setattr(f"rosz.graph.{module}.COMPLETE_BY", TIMEOUT)


@pytest.fixture
def network() -> Iterator[Network]:
    """A network for one test alone."""
    made = Network()
    yield made
    made.close()
