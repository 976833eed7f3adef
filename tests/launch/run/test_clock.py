"""A launch with simulated time says once that nobody publishes the time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from network import TIMEOUT, eventually, free_port

from rosz.launch.plan import Plan
from rosz.launch.run import Network, runner
from rosz.session import Session, SessionConfig
from rosz.wire import entity_key

from .in_thread import MemoryNetwork, launch, param, shell

DOMAIN = 3
SIMULATED = Plan(params=(param("/use_sim_time", True),))
WARNING = "WARNING: /use_sim_time is set, and /clock is silent after "


@pytest.fixture
def network() -> Iterator[Network]:
    with Session.open(SessionConfig(rendezvous=f"tcp/127.0.0.1:{free_port()}")) as session:
        yield MemoryNetwork(session, DOMAIN)


def test_a_silent_clock_is_reported_once(
    tmp_path: Path, network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "_CLOCK_TIMEOUT", 0.05)
    late = shell("n", "sleep 0.5; echo over >&2; exit 1")
    with launch(tmp_path, late, plan=SIMULATED, network=network) as run:
        run.err.wait_for(f"{WARNING}0.05 s: until it ticks")
        run.err.wait_for("process has died")
        assert run.join() == 0
    assert run.err.getvalue().count(WARNING) == 1


def test_a_clock_that_is_heard_is_not_reported(
    tmp_path: Path, network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "_CLOCK_TIMEOUT", TIMEOUT)  # a busy machine is slow to hear it
    assert network.session is not None
    clock = network.session.publisher(
        entity_key(DOMAIN, "/clock", "rosgraph_msgs/msg/Clock", "RIHS01_00")
    )
    with launch(tmp_path, shell("n", "exec sleep 600"), plan=SIMULATED, network=network) as run:
        eventually(lambda: clock.matched, "a subscriber of /clock")
        clock.put(b"")
        eventually(lambda: not clock.matched, "the end of the subscriber")
        assert run.stop() == 0
    assert WARNING not in run.err.getvalue()


def test_wall_time_needs_no_clock(
    tmp_path: Path, network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "_CLOCK_TIMEOUT", 0.0)
    plan = Plan(params=(param("/use_sim_time", False),))
    with launch(tmp_path, shell("n", "exit 1"), plan=plan, network=network) as run:
        run.err.wait_for("process has died")
        assert run.join() == 0
    assert WARNING not in run.err.getvalue()
