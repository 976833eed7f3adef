"""A running launch answers from another session: what runs, and please restart or stop that."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from rosz.errors import LaunchError, NotFoundError
from rosz.launch.run import Network, order, statuses
from rosz.session import Query, Session, SessionConfig
from rosz.wire import own_key

from .scene import Facts, MemoryStore, alive, launch, program, shell, wait_until

DOMAIN = 3


@pytest.fixture
def rendezvous() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def network(rendezvous: str) -> Iterator[Network]:
    with Session.open(SessionConfig(rendezvous=rendezvous)) as session:
        yield Network(store=MemoryStore(), readiness=Facts(), session=session, domain=DOMAIN)


@pytest.fixture
def asker(rendezvous: str, network: Network) -> Iterator[Session]:
    assert network.session is not None
    config = SessionConfig(mode="client", rendezvous=rendezvous, must_connect=True)
    with Session.open(config) as session:
        yield session


SLEEPERS = [
    shell("a", "exec sleep 600"),
    shell("b", "exit 3", namespace="/space"),
    program("c", "/no/such/program"),
]


def test_status(tmp_path: Path, network: Network, asker: Session) -> None:
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        run.err.wait_for("[space/b-2] process has died")
        (status,) = statuses(asker, DOMAIN)
        assert statuses(asker, DOMAIN + 1) == []
    assert (status.run_id, status.pid) == (run.runner.run_id, os.getpid())
    a, b, c = status.nodes
    assert (a.name, a.type, a.state, a.detail) == ("/a", "sh -c exec sleep 600", "running", "")
    assert (a.pid, a.restarts) == (run.pid("a-1"), 0)
    assert a.uptime > 0
    assert a.memory > 100_000
    assert (b.name, b.state, b.detail) == ("/space/b", "ended", "ended with exit code 3")
    assert (b.pid, b.memory, b.uptime) == (0, 0, 0)
    assert (c.name, c.state, c.pid) == ("/c", "failed", 0)
    assert c.detail.startswith("unable to launch [c-3]: No such file or directory")
    assert statuses(asker, DOMAIN) == []


def test_restart(tmp_path: Path, network: Network, asker: Session) -> None:
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        first = run.pid("a-1")
        run.err.wait_for("[space/b-2] process has died")
        order(asker, DOMAIN, "restart", "a")
        assert not alive(first)
        (status,) = statuses(asker, DOMAIN)
        assert (status.nodes[0].restarts, status.nodes[0].state) == (1, "running")
        order(asker, DOMAIN, "restart", "/space/b")
        run.err.wait_for("[space/b-2] process has died", times=2)


def test_stop(tmp_path: Path, network: Network, asker: Session) -> None:
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        pid = run.pid("a-1")
        run.err.wait_for("[space/b-2] process has died")
        order(asker, DOMAIN, "stop", "/a")
        assert not alive(pid)
        assert run.join() == 1  # of c, which could not be started
    assert "all processes on machine have died" in run.out.getvalue()


def test_orders_that_cannot_be_carried_out(
    tmp_path: Path, network: Network, asker: Session
) -> None:
    with pytest.raises(NotFoundError, match=r"no launch runs a node '/a'; no launch is running"):
        order(asker, DOMAIN, "stop", "a")
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        run.pid("a-1")
        with pytest.raises(NotFoundError, match=r"'/space/bb'; did you mean '/space/b'\?"):
            order(asker, DOMAIN, "restart", "/space/bb")
        with pytest.raises(LaunchError, match=r"'/c' did not start again: unable to launch"):
            order(asker, DOMAIN, "restart", "c")


def test_a_launch_that_ends_answers_no_more(
    tmp_path: Path, network: Network, asker: Session
) -> None:
    ready = tmp_path / "ready"
    slow = shell("s", f"trap 'sleep 0.7; exit 0' INT; touch {ready}; sleep 600 & wait")
    with launch(tmp_path, slow, network=network) as run:
        run.pid("s-1")
        wait_until(ready.exists, "trap")
        run.runner.stop()
        run.out.wait_for("killing on exit")
        with pytest.raises(LaunchError, match="this launch is ending"):
            order(asker, DOMAIN, "restart", "/s")
        run.join()


def test_an_answer_that_makes_no_sense(network: Network, asker: Session) -> None:
    assert network.session is not None
    key = own_key(DOMAIN, "launch", "1", network.session.zid)

    def answer(query: Query) -> None:
        with query:
            query.reply(key, b"{}")

    with (
        closing(network.session.queryable(key, answer)),
        pytest.raises(LaunchError, match=f"answers at '{key}' makes no sense: .*version"),
    ):
        statuses(asker, DOMAIN)
