from __future__ import annotations

import signal
import socket
from pathlib import Path

import pytest
from network import Network, Program, free_port

from .shell import Shell

NODE = """
    import sys
    import rosz
    with rosz.Node(sys.argv[1]) as node:
        print("ready", flush=True)
        node.spin()
"""
POLL = """
    from rosz.cli.main import run
    while run(["param", "list"]):
        print("asked", flush=True)
"""


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


def test_the_configuration_for_zenohd(shell: Shell, network: Network) -> None:
    further = f"tcp/127.0.0.1:{free_port()}"
    there = ["tcp/10.0.0.1:7447"]
    found = shell("core", "--print-config", "--listen", further, "--connect", there[0]).json
    assert (found["mode"], found["connect"]["endpoints"]) == ("router", there)
    assert found["listen"]["endpoints"] == [network.rendezvous, further]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_core_ends_at_once(core: Program, number: signal.Signals) -> None:
    core.send(number)
    assert core.exit_code() == 0
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


def test_an_occupied_endpoint_is_one_line_that_names_it(shell: Shell) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        result = shell("core", "--listen", endpoint)
    assert result.code == 1
    assert result.err.startswith(f"ERROR: '{endpoint}' is occupied by '")
    assert result.err.count("\n") == 1


def test_a_core_that_starts_after_a_node(shell: Shell, network: Network) -> None:
    """It is linked to the node, and takes its place when that ends."""
    holder = network.program(NODE, "holder")
    holder.wait_for("ready")
    core = shell.start("core")
    core.wait_for(f"{network.rendezvous} is held by ")
    core.wait_for("started core")
    assert shell("node", "list").lines == ["/holder"]
    assert shell("param", "set", "/speed", "3").code == 0
    holder.kill()
    core.wait_for(f"listening on {network.rendezvous}, which has become free")
    network.node("later")
    assert shell("node", "list").lines == ["/later"]
    assert shell("param", "get", "/speed").out == "3\n"
    core.send(signal.SIGINT)
    assert core.exit_code() == 0


def test_a_core_and_commands_that_wait_for_it(shell: Shell, network: Network) -> None:
    """No command holds the meeting point, so the core listens there itself."""
    network.rendezvous = f"tcp/127.0.0.1:{free_port()}"
    waiting = [network.program(POLL) for _ in range(4)]
    for program in waiting:
        program.wait_for("asked")
    core = shell.start("core")
    core.wait_for("started core")
    assert core.lines[0] == f"listening on {network.rendezvous}"
    for program in waiting:
        assert program.exit_code() == 0


@pytest.mark.usefixtures("core")
def test_a_core_for_each_domain(shell: Shell) -> None:
    again = shell("core")
    assert again.code == 1
    assert again.err.startswith("ERROR: a core of domain 42 runs already at ")
    other = shell.start("core", ROS_DOMAIN_ID="43")
    other.wait_for("parameters of domain 43 are kept in memory")
    other.wait_for("started core")
    assert shell("param", "set", "/speed", "3").code == 0
    there = shell.start("param", "list", ROS_DOMAIN_ID="43")
    assert there.exit_code() == 0
    assert there.lines == ["/rosdistro", "/rosversion", "/run_id"]


def test_a_rendezvous_held_by_what_is_not_zenoh(shell: Shell, network: Network) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        network.rendezvous = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        core = shell.start("core")
        core.wait_for(f"ERROR: '{network.rendezvous}' is held by '")
        assert "which does not speak Zenoh" in core.output
        assert core.exit_code() == 1


def test_further_endpoints(shell: Shell, network: Network) -> None:
    first, second = (f"unixsock-stream/{network.folder}/{name}" for name in ("a", "b"))
    core = shell.start("core", "--listen", first, "--listen", second, "--connect", first)
    core.wait_for("started core")
    assert core.lines[1:3] == [f"listening on {first}", f"listening on {second}"]


def test_a_core_waits_for_another(shell: Shell, network: Network) -> None:
    """It dials for as long as it lives, and prints what is reached, and each change once."""
    far = f"unixsock-stream/{network.folder}/far"
    core = shell.start("core", "--connect", far)
    core.wait_for("started core")
    assert f"waiting for {far}" in core.lines
    other = shell.start("core", ROSZ_RENDEZVOUS=far)
    core.wait_for(f"connected to {far}")
    other.kill()
    core.wait_for(f"the link to {far} is lost: waiting for it")
    shell.start("core", ROSZ_RENDEZVOUS=far)
    core.wait_for(f"connected to {far}", times=2)
    assert core.output.count(far) == 4


@pytest.mark.parametrize("option", ["--listen", "--connect"])
@pytest.mark.parametrize("endpoint", ["nonsense", "foo/bar:1", "tcp/10.0.0"])
def test_a_malformed_endpoint(shell: Shell, option: str, endpoint: str) -> None:
    result = shell("core", option, endpoint)
    assert result.code == 2
    assert result.err.startswith(f"ERROR: {option} is '{endpoint}'; expected PROTOCOL/ADDRESS")
    assert result.err.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (("--as", ""), "--as is '': expected a namespace such as /robot1"),
        (("--as", "/robot1", "--share", ""), "--share has ''; expected such as /odom"),
        (("--share", "/odom"), "no namespace for this machine: expected --as /robot1\n"),
    ],
)
def test_what_would_let_all_names_leave(shell: Shell, options: tuple[str, ...], error: str) -> None:
    result = shell("core", "--connect", f"tcp/127.0.0.1:{free_port()}", *options)
    assert result.code == 2
    assert result.err.startswith(f"ERROR: {error}")


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
