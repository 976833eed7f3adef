"""The sessions of this machine: seen before there is a link, stopped or not, gone when they end."""

from __future__ import annotations

import os
import re
import signal
import socket
from pathlib import Path

import pytest
from network import Network, Program, eventually

from rosz.errors import TransportError
from rosz.session import LocalPeers, Session, SessionConfig, describe_process, is_stopped
from rosz.session.local_peers import LocalRegistration, direct_endpoint, find_listener
from rosz.wire import Endpoint

LISTEN = """
    import socket, sys
    kind, place = sys.argv[1:]
    with socket.socket(socket.AF_UNIX if kind == "unix" else socket.AF_INET) as server:
        server.bind(place if kind == "unix" else ("127.0.0.1", 0))
        server.listen()
        print("at", place if kind == "unix" else server.getsockname()[1])
        sys.stdin.read()
"""
NODE = """
    import sys
    import rosz
    with rosz.Node(sys.argv[1]) as node:
        print("up")
        node.spin()
"""
OLD = """
    import sys
    import rosz
    with rosz.Node(sys.argv[1]) as node:
        node.params.set(f"/from/{sys.argv[1]}", 1)
        print("up")
        node.spin()
"""
NEW = """
    import rosz
    from rosz.params.replica import replica
    rosz.Context.MESH_TIMEOUT = replica._MESH_TIMEOUT = 50.0  # a busy machine takes longer
    with rosz.Node("new") as node:
        print("read", sorted(node.params.get("/from", {})))
"""
BESIDE = """
    import socket
    import rosz
    mine, yours = socket.socketpair()
    place = "\\0" + "x" * 20
    server = socket.socket(socket.AF_UNIX)
    server.bind(place)
    server.listen()
    near = socket.socket(socket.AF_UNIX)
    near.connect(place)
    far, _ = server.accept()
    with rosz.Node("beside"):
        pass
    mine.sendall(b"a")
    near.sendall(b"b")
    print("both", yours.recv(1) + far.recv(1))
    for one in (mine, yours, server, near, far):
        one.close()
"""


def stop(program: Program) -> None:
    program.send(signal.SIGSTOP)
    eventually(lambda: is_stopped(program.pid), "the program is stopped")


def test_a_process_that_is_stopped(network: Network) -> None:
    program = network.program("print('up'); input()")
    program.wait_for("up")
    assert not is_stopped(program.pid)
    stop(program)
    program.send(signal.SIGCONT)
    eventually(lambda: not is_stopped(program.pid), "it goes on")
    program.kill()
    assert not is_stopped(program.pid)


def test_a_process_whose_name_is_no_utf8(network: Network) -> None:
    program = network.program(
        """
        from pathlib import Path
        Path("/proc/self/comm").write_bytes(b"\\xff) T (")
        print("up")
        input()
        """
    )
    program.wait_for("up")
    assert not is_stopped(program.pid)
    stop(program)


def test_a_process_by_its_command(network: Network, tmp_path: Path) -> None:
    script = tmp_path / "talker.py"
    script.write_text("print('up'); input()")
    program = network.run(str(script), "_rate:=10")
    program.wait_for("up")
    assert describe_process(program.pid) == f"'talker.py _rate:=10' (pid {program.pid})"
    program.kill()
    assert describe_process(program.pid) == f"process {program.pid}"


@pytest.mark.parametrize("kind", ["unix", "tcp"])
def test_who_listens_somewhere(network: Network, kind: str) -> None:
    program = network.program(LISTEN, kind, str(network.folder / "s"))
    place = program.wait_for("at ").split()[1]
    endpoint = f"unixsock-stream/{place}" if kind == "unix" else f"tcp/localhost:{place}"
    assert find_listener(Endpoint(endpoint), [os.getpid(), program.pid]) == program.pid
    assert find_listener(Endpoint(endpoint), [os.getpid()]) is None
    program.kill()
    assert find_listener(Endpoint(endpoint), [os.getpid(), program.pid]) is None


def peers(network: Network) -> LocalPeers:
    return LocalPeers.read(network.rendezvous)


def test_a_registration_says_where_its_session_is_reached(network: Network) -> None:
    session = network.session()
    (peer,) = peers(network)
    assert (peer.pid, peer.zid) == (os.getpid(), session.zid)
    with socket.create_connection(("127.0.0.1", peer.port), 1):
        pass
    session.close()
    assert list(peers(network)) == []


def test_a_registration_is_there_before_its_session(network: Network) -> None:
    one = LocalRegistration(network.rendezvous)
    other = LocalRegistration(network.rendezvous, reachable=False)
    assert set(peers(network)) == {one.peer, other.peer}
    assert direct_endpoint(network.rendezvous, one.peer) == f"tcp/127.0.0.1:{one.peer.port}"
    assert direct_endpoint(network.rendezvous, other.peer) == ""
    one.opened("abc")
    assert {peer.zid for peer in peers(network)} == {"", "abc"}
    one.close()
    other.close()
    assert list(peers(network)) == []


def test_nobody_is_there_where_all_are_stopped(network: Network) -> None:
    assert not peers(network).has_peers
    program = network.program(NODE, "a")
    program.wait_for("up")
    assert peers(network).has_peers
    assert peers(network).why_unanswered == ""
    stop(program)
    assert not peers(network).has_peers
    assert f"'kill -CONT {program.pid}'" in peers(network).why_unanswered
    program.send(signal.SIGCONT)
    eventually(lambda: peers(network).has_peers, "it runs again")


def test_sessions_that_are_out_of_reach(network: Network) -> None:
    programs = [network.program(NODE, name) for name in ("a", "b")]
    for program in programs:
        program.wait_for("up")
    session = network.session()
    assert session.out_of_reach() == set()
    stop(programs[1])
    stopped = {peer.zid for peer in peers(network) if peer.pid == programs[1].pid}
    assert session.out_of_reach() == stopped
    assert len(stopped) == 1


@pytest.mark.parametrize("held", ["core", "node"])
def test_sockets_of_the_program_are_left_alone(network: Network, held: str) -> None:
    """A session that closes beside a stopped one ends only its own connections."""
    holder = network.program(NODE, "a") if held == "node" else network.run("-m", "rosz", "core")
    holder.wait_for("up" if held == "node" else "listening")
    stop(holder)
    beside = network.program(BESIDE)
    assert beside.wait_for("both") == "both b'ab'"
    assert beside.exit_code() == 0
    assert "Warning" not in beside.output


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "ended"])
def test_registrations_end_with_their_process(network: Network, number: signal.Signals) -> None:
    assert not peers(network).has_peers
    program = network.program(OLD, "a")
    program.wait_for("up")
    assert peers(network).has_peers
    program.send(number)
    program.exit_code()
    assert not peers(network).has_peers


def test_a_newcomer_right_after_the_death_of_the_first(network: Network) -> None:
    """It holds the rendezvous now, and nobody has found it yet; still it finds all parameters."""
    programs = {}
    for name in ("first", "second", "third"):
        programs[name] = network.program(OLD, name)
        programs[name].wait_for("up")
    programs["first"].kill()
    newcomer = network.program(NEW)
    assert newcomer.wait_for("read") == "read ['first', 'second', 'third']"


def test_a_second_router_of_a_process_is_refused(network: Network) -> None:
    config = SessionConfig(mode="router", rendezvous=network.rendezvous)
    with Session.open(config):
        told = rf"has a router at {re.escape(network.rendezvous)} already.*: close that one first"
        with pytest.raises(TransportError, match=told):
            Session.open(config)
    Session.open(config).close()


def test_of_two_that_open_at_once_one_sees_the_other(network: Network) -> None:
    """Each registers before it reads; what was read before may lack the other."""
    one, other = LocalRegistration(network.rendezvous), LocalRegistration(network.rendezvous)
    assert list(LocalPeers.read(network.rendezvous, one.peer)) == [other.peer]
    assert list(LocalPeers.read(network.rendezvous, other.peer)) == [one.peer]
    one.close()
    other.close()
