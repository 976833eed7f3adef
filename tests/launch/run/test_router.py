"""Launches of many nodes start a router, restart it, and end it."""

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
from network import eventually

from rosz.launch.run import Network, RouterProcess, needs_router
from rosz.launch.run.network import MESH_LIMIT
from rosz.node import Context
from rosz.session import is_listening

from .in_thread import alive, launch, shell

MANY = MESH_LIMIT + 1


@pytest.fixture
def router(network: Net) -> Iterator[RouterProcess]:
    with RouterProcess(network.environment(), network.variables()) as started:
        yield started


def test_when_a_router_is_needed(network: Net) -> None:
    environment = network.environment()
    assert needs_router(MANY, environment, {})
    assert not needs_router(MESH_LIMIT, environment, {})
    assert not needs_router(MANY, environment, {"ROSZ_MODE": "peer"})
    own = msgspec.structs.replace(environment, zenoh_config="own.json5")
    assert not needs_router(MANY, own, {})
    dialling = msgspec.structs.replace(environment, connect=("tcp/robot:7447",))
    assert needs_router(1, dialling, {})
    assert not needs_router(0, dialling, {})
    network.session()
    assert not needs_router(MANY, environment, {})
    assert not needs_router(1, dialling, {})


def test_a_router_listens_until_closed(router: RouterProcess, network: Net) -> None:
    assert is_listening(network.rendezvous)
    assert alive(router.pid)
    assert (router.environment.mode, router.environ["ROSZ_MODE"]) == ("client", "client")
    with Context(router.environment) as one, Context(router.environment) as two:
        one.params.set("/x", 1)
        assert two.params.get("/x") == 1
    router.close()
    assert not alive(router.pid)
    assert not is_listening(network.rendezvous)


def test_a_launch_restarts_its_router(router: RouterProcess, tmp_path: Path) -> None:
    with Context(router.environment) as context:
        nodes = [shell("n", "exec sleep 600")]
        with launch(tmp_path, *nodes, network=Network(context, router)) as run:
            assert f"process[core]: started with pid [{router.pid}]" in run.out.wait_for(
                "n-1]: start"
            )
            first = router.pid
            os.kill(first, signal.SIGKILL)
            run.err.wait_for(f"[core] process has died [pid {first}, exit code -9].")
            run.out.wait_for("process[core]: started", times=2)
            eventually(lambda: is_listening(router.environment.rendezvous), "the new core")
            assert router.pid != first
            eventually(context.session.peers, "the link to it")
            assert run.stop() == 0
        assert alive(router.pid)


def test_a_router_that_cannot_restart_ends_no_node(
    router: RouterProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = RouterProcess._start
    refusals = [BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")]

    def refuse_once(self: RouterProcess) -> subprocess.Popen[bytes]:
        if refusals:
            raise refusals.pop()
        return start(self)

    monkeypatch.setattr(RouterProcess, "_start", refuse_once)
    with Context(router.environment) as context:
        nodes = [shell("n", "exec sleep 600")]
        with launch(tmp_path, *nodes, network=Network(context, router)) as run:
            run.pid("n-1")
            os.kill(router.pid, signal.SIGKILL)
            run.err.wait_for("[core] cannot be started: Resource temporarily unavailable")
            run.out.wait_for("process[core]: started", times=2)
            assert alive(run.pid("n-1"))
            assert run.stop() == 0


def test_a_router_that_does_not_start_is_explained(
    network: Net, capfd: pytest.CaptureFixture[str]
) -> None:
    from rosz.errors import LaunchError

    environment = network.environment(rendezvous="unixsock-stream//proc/nowhere/z.sock")
    variables = network.variables(ROSZ_RENDEZVOUS="unixsock-stream//proc/nowhere/z.sock")
    with pytest.raises(
        LaunchError, match="ended with exit code 1; ROSZ_MODE=peer starts them without"
    ):
        RouterProcess(environment, variables)
    assert capfd.readouterr().err.startswith("ERROR: ")
