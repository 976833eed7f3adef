from __future__ import annotations

import signal
from pathlib import Path

import pytest
from network import Network, Program

from .shell import Shell


@pytest.fixture
def core(shell: Shell) -> Program:
    started = shell.start("core")
    started.wait_for("started core")
    return started


def test_core_prints_where_it_listens(core: Program, network: Network) -> None:
    assert core.lines == [
        f"listening on {network.rendezvous}",
        "parameters of domain 42 are kept in memory",
        "started core; press Ctrl-C to end it",
    ]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_core_ends_at_once(core: Program, number: signal.Signals) -> None:
    core.send(number)
    assert core.exit_code(timeout=3) == 0
    assert len(core.lines) == 3


@pytest.mark.usefixtures("core")
def test_nodes_meet_at_a_core(shell: Shell, network: Network) -> None:
    assert shell("node", "list").lines == []
    network.node("one")
    network.node("two")
    assert shell("node", "list").lines == ["/one", "/two"]


@pytest.mark.usefixtures("core")
def test_core_holds_the_parameters(shell: Shell) -> None:
    assert shell("param", "set", "/speed", "3").code == 0
    assert shell("param", "get", "/speed").out == "3\n"


@pytest.mark.usefixtures("core")
def test_core_sets_the_parameters_that_roscore_sets(shell: Shell) -> None:
    assert shell("param", "list").lines == ["/rosdistro", "/rosversion", "/run_id"]


def test_core_keeps_parameters_that_are_set(shell: Shell, tmp_path: Path) -> None:
    store = tmp_path / "params.db"
    runs = set()
    for _ in range(2):
        core = shell.start("core", "--store", str(store))
        core.wait_for("started core")
        runs.add(shell("param", "get", "/run_id").out)
        core.send(signal.SIGINT)
        core.exit_code()
    assert len(runs) == 1


def test_an_occupied_endpoint_is_one_line_that_names_it(shell: Shell, network: Network) -> None:
    network.node("holder")
    result = shell("core")
    assert result.code == 1
    assert result.err.startswith(f"ERROR: '{network.rendezvous}' is occupied")
    assert result.err.count("\n") == 1


def test_further_endpoints(shell: Shell, network: Network) -> None:
    first, second = (f"unixsock-stream/{network.folder}/{name}" for name in ("a", "b"))
    core = shell.start("core", "--listen", first, "--listen", second, "--connect", first)
    core.wait_for("started core")
    assert core.lines[1:4] == [
        f"listening on {first}",
        f"listening on {second}",
        f"connecting to {first}",
    ]


def test_a_malformed_endpoint(shell: Shell) -> None:
    result = shell("core", "--listen", "nonsense")
    assert result.code == 1
    assert "nonsense" in result.err
    assert result.err.count("\n") == 1


def test_a_store_outlives_its_core(shell: Shell, tmp_path: Path) -> None:
    store = tmp_path / "params.db"
    for expected in ("", "left\n"):
        core = shell.start("core", "--store", str(store))
        core.wait_for(f"parameters of domain 42 are kept in {store}")
        core.wait_for("started core")
        assert shell("param", "get", "/kept").out == expected
        assert shell("param", "set", "/kept", "left").code == 0
        core.kill()


def test_a_store_that_is_another_file(shell: Shell, tmp_path: Path) -> None:
    store = tmp_path / "params.db"
    store.write_text("a letter to my aunt, which is long enough to be looked at\n" * 20)
    result = shell("core", "--store", str(store))
    assert result.code == 1
    assert str(store) in result.err
    assert store.read_text().startswith("a letter")


def test_there_is_no_master(shell: Shell) -> None:
    result = shell("core", "-p", "11311")
    assert result.code == 2
    assert "there is no master" in result.err
