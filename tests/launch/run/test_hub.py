"""Launches of many nodes start a core, keep it up, and end it."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from network import Network as Net

from rosz.launch.run import Hub, Network, wants_hub
from rosz.launch.run.hub import MESH_LIMIT
from rosz.node import Context
from rosz.session import is_listening

from .scene import alive, launch, shell, wait_until

MANY = MESH_LIMIT + 1


@pytest.fixture
def hub(network: Net) -> Iterator[Hub]:
    with Hub(network.environment(), network.variables()) as started:
        yield started


def test_when_a_core_is_started(network: Net) -> None:
    environment = network.environment()
    assert wants_hub(MANY, environment, {})
    assert not wants_hub(MESH_LIMIT, environment, {})
    assert not wants_hub(MANY, environment, {"ROSZ_MODE": "peer"})
    own = msgspec.structs.replace(environment, zenoh_config="own.json5")
    assert not wants_hub(MANY, own, {})
    dialling = msgspec.structs.replace(environment, connect=("tcp/robot:7447",))
    assert wants_hub(1, dialling, {})
    assert not wants_hub(0, dialling, {})
    network.session()
    assert not wants_hub(MANY, environment, {})
    assert not wants_hub(1, dialling, {})


def test_it_is_up_when_it_is_there_and_gone_when_closed(hub: Hub, network: Net) -> None:
    assert is_listening(network.rendezvous)
    assert alive(hub.pid)
    assert (hub.environment.mode, hub.environ["ROSZ_MODE"]) == ("client", "client")
    with Context(hub.environment) as one, Context(hub.environment) as two:
        one.params.set("/x", 1)
        assert two.params.get("/x") == 1
    hub.close()
    assert not alive(hub.pid)
    assert not is_listening(network.rendezvous)


def test_a_launch_keeps_it_up(hub: Hub, tmp_path: Path) -> None:
    with Context(hub.environment) as context:
        nodes = [shell("n", "exec sleep 600")]
        with launch(tmp_path, *nodes, network=Network.of(context, hub)) as run:
            assert f"process[core]: started with pid [{hub.pid}]" in run.out.wait_for("n-1]: start")
            first = hub.pid
            os.kill(first, signal.SIGKILL)
            run.err.wait_for(f"[core] process has died [pid {first}, exit code -9].")
            run.out.wait_for("process[core]: started", times=2)
            wait_until(lambda: is_listening(hub.environment.rendezvous), "the new core")
            assert hub.pid != first
            wait_until(context.session.peers, "the link to it")
            assert run.stop() == 0
        assert alive(hub.pid)


def test_a_core_that_cannot_be_started_again_ends_nothing(
    hub: Hub, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = Hub._start
    refusals = [BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")]

    def refuse_once(self: Hub) -> subprocess.Popen[bytes]:
        if refusals:
            raise refusals.pop()
        return start(self)

    monkeypatch.setattr(Hub, "_start", refuse_once)
    with Context(hub.environment) as context:
        nodes = [shell("n", "exec sleep 600")]
        with launch(tmp_path, *nodes, network=Network.of(context, hub)) as run:
            run.pid("n-1")
            os.kill(hub.pid, signal.SIGKILL)
            run.err.wait_for("[core] cannot be started: Resource temporarily unavailable")
            run.out.wait_for("process[core]: started", times=2)
            assert alive(run.pid("n-1"))
            assert run.stop() == 0


def test_a_core_that_does_not_start_is_explained(
    network: Net, capfd: pytest.CaptureFixture[str]
) -> None:
    from rosz.errors import LaunchError

    environment = network.environment(rendezvous="unixsock-stream//no/such/folder/z.sock")
    variables = network.variables(ROSZ_RENDEZVOUS="unixsock-stream//no/such/folder/z.sock")
    with pytest.raises(LaunchError, match="ended with exit code 1; ROSZ_MODE=peer does without"):
        Hub(environment, variables)
    assert capfd.readouterr().err.startswith("rosz: ")
