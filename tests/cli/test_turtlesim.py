from __future__ import annotations

import subprocess
import sys

import pytest
from network import Network

from rosz.session import Query
from rosz.turtlesim import snapshot
from rosz.turtlesim.simulator import Simulator
from rosz.wire import own_key

from .shell import Shell


@pytest.fixture
def sim(network: Network) -> Simulator:
    """A running simulation."""
    return Simulator(network.node("turtlesim"))


def test_snapshot_writes_a_picture(shell: Shell, sim: Simulator) -> None:
    assert shell("turtlesim", "snapshot", "field.png").lines == []
    assert (shell.network.folder / "field.png").read_bytes() == sim.picture().png
    assert shell("turtlesim", "snapshot", "--node", "turtlesim", "by_name.PNG").code == 0


def test_snapshot_to_stdout(network: Network, sim: Simulator) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rosz", "turtlesim", "snapshot", "-"],
        env=network.variables(),
        capture_output=True,
        timeout=300,
        check=True,
    )
    assert done.stdout == sim.picture().png


@pytest.mark.usefixtures("sim")
def test_errors(shell: Shell) -> None:
    wrong = shell("turtlesim", "snapshot", "field.jpg")
    assert (wrong.code, wrong.out) == (2, "")
    assert "'field.jpg' does not end in .png" in wrong.err
    unknown = shell("turtlesim", "snapshot", "field.png", "--node", "/turtlesin")
    assert unknown.code == 1
    assert "did you mean '/turtlesim'?" in unknown.err
    lost = shell("turtlesim", "snapshot", "nowhere/field.png")
    assert lost.code == 1
    assert lost.err == "ERROR: nowhere/field.png: No such file or directory\n"


def test_no_turtlesim_runs(shell: Shell, network: Network) -> None:
    network.node("somebody")
    result = shell("turtlesim", "snapshot", "field.png")
    assert result.code == 1
    assert "no turtlesim is running: start 'rosz run turtlesim turtlesim_node'" in result.err


def test_a_turtlesim_that_does_not_respond(
    shell: Shell, network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshot, "_TIMEOUT", 0.5)
    session = network.node("turtlesim").context.session
    waiting: list[Query] = []
    queryable = session.queryable(
        own_key(network.domain, "picture", session.zid, "1"), waiting.append
    )
    result = shell("turtlesim", "snapshot", "field.png")
    assert result.code == 1
    assert "no picture within 0.5 s; a turtlesim runs, but does not respond" in result.err
    queryable.close()
    for query in waiting:
        query.close()
