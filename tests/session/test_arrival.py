"""Many nodes that come at once: at one core, which may be busy, or in one mesh."""

from __future__ import annotations

import resource
import socket
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from network import TIMEOUT, Network, eventually, free_port

from rosz.session import Session, SessionConfig, mesh, opening
from rosz.session.config import zenoh_settings
from rosz.session.local_peers import LocalRegistration

CORE = ("-m", "rosz", "core")


def test_a_busy_core_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Each attempt is given up, and the reason is told once; then the core has time for it."""
    monkeypatch.setattr(opening, "_BUSY_TIMEOUT", 0.3)
    monkeypatch.setattr(opening, "_SLOW_SECONDS", 0.01)
    place = f"tcp/127.0.0.1:{free_port()}"
    given_up = threading.Semaphore(0)
    once = opening._open_once

    def count(*given: object) -> object:
        given_up.release()
        return once(*given)  # type: ignore[arg-type]  # what it was called with

    monkeypatch.setattr(opening, "_open_once", count)
    settings = SessionConfig(mode="client", rendezvous=place, open_timeout=0.1)
    busy = socket.create_server(("127.0.0.1", int(place.rpartition(":")[2])))
    registration = LocalRegistration(place, reachable=False)
    with ThreadPoolExecutor(1) as threads:
        opened = threads.submit(Session.open, settings)
        for _ in range(3):
            assert given_up.acquire(timeout=TIMEOUT)
        monkeypatch.setattr(opening, "_BUSY_TIMEOUT", TIMEOUT)
        registration.close()
        busy.close()
        core = Session.open(SessionConfig(mode="router", rendezvous=place))
        with core, opened.result(TIMEOUT) as session:
            assert session.peers() == [core.zid]
    texts = [record.getMessage() for record in caplog.records]
    first, last = (text for text in texts if place in text)
    assert first.startswith(f"waiting for {place}: it is busy: it accepts connections")
    assert last == f"connected to {place}"


def test_a_crowd_at_a_narrow_door(network: Network) -> None:
    """A core that lets few open links at a time serves all, one after the other."""
    few = "transport/unicast/accept_pending=2"
    settings = SessionConfig(mode="client", rendezvous=network.rendezvous, open_timeout=TIMEOUT)
    router = SessionConfig(mode="router", rendezvous=network.rendezvous, override=few)
    with Session.open(router) as core, ThreadPoolExecutor(30) as threads:
        sessions = list(threads.map(Session.open, [settings] * 30))
        assert len(core.links()) == 30
        for session in sessions:
            session.close()


def test_sessions_do_not_come_back_in_step() -> None:
    """Those that lost their core try it at different times, and wait as long as it takes."""
    client = SessionConfig(mode="client", rendezvous="tcp/127.0.0.1:7447")
    found = [zenoh_settings(client) for _ in range(20)]
    periods = {one["connect"]["retry"]["period_init_ms"] for one in found}
    assert len(periods) > 1
    assert min(periods) >= 100
    assert max(periods) < 300
    core = zenoh_settings(SessionConfig(mode="router", rendezvous="tcp/127.0.0.1:7447"))
    asked, served = (one["transport"]["unicast"] for one in (found[0], core))
    assert asked["open_timeout"] >= 60_000 <= served["accept_timeout"]
    assert served["accept_pending"] >= 1000 <= served["max_sessions"]


def test_a_core_opens_all_files_that_it_may(network: Network) -> None:
    soft, hard = 100, 600
    code = (
        "import os, resource, sys\n"
        f"resource.setrlimit(resource.RLIMIT_NOFILE, ({soft}, {hard}))\n"
        "os.execv(sys.executable, [sys.executable, '-P', *sys.argv[1:]])"
    )
    core = network.run("-c", code, *CORE)
    core.wait_for("this core may open 600 files")
    core.wait_for("started core")
    assert resource.prlimit(core.pid, resource.RLIMIT_NOFILE) == (hard, hard)
    resource.prlimit(core.pid, resource.RLIMIT_NOFILE, (3, hard))
    core.wait_for("no room for more links: Too many open files (the limit is 3,")
    resource.prlimit(core.pid, resource.RLIMIT_NOFILE, (hard, hard))
    core.wait_for("there is room for links again")
    assert sum("no room" in line for line in core.lines) == 1


def test_a_newcomer_to_a_large_mesh(
    network: Network, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(mesh, "_MOST_PEERS", 2)
    for seconds in ("_SILENT_SECONDS", "_BUSY_SECONDS"):  # the nodes of this test all reply
        monkeypatch.setattr(mesh, seconds, TIMEOUT)
    first, second = network.node("one").context, network.node("two").context
    assert second.mesh.linked.wait(TIMEOUT)
    eventually(lambda: first.session.peers() == [second.session.zid], "both are linked")
    assert "use a core" not in caplog.text
    assert network.node("three").context.mesh.linked.wait(TIMEOUT)
    assert "2 other sessions are here, each linked to all" in caplog.text
    assert "run 'rosz core', and start nodes with ROSZ_MODE=client" in caplog.text
