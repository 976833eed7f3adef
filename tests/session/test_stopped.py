"""Seeing which processes are stopped, by what they leave behind on the machine."""

from __future__ import annotations

import os
import signal
import socket
from pathlib import Path

import pytest
from network import Network, Program, eventually

from rosz.session.presence import Presence, is_anybody_awake, marks, why_unanswered
from rosz.session.stopped import describe, is_stopped, listener
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
    assert describe(program.pid) == f"'talker.py _rate:=10' (pid {program.pid})"
    program.kill()
    assert describe(program.pid) == f"process {program.pid}"


@pytest.mark.parametrize("kind", ["unix", "tcp"])
def test_who_listens_somewhere(network: Network, kind: str) -> None:
    program = network.program(LISTEN, kind, str(network.folder / "s"))
    place = program.wait_for("at ").split()[1]
    endpoint = f"unixsock-stream/{place}" if kind == "unix" else f"tcp/localhost:{place}"
    assert listener(Endpoint(endpoint), [os.getpid(), program.pid]) == program.pid
    assert listener(Endpoint(endpoint), [os.getpid()]) is None
    program.kill()
    assert listener(Endpoint(endpoint), [os.getpid(), program.pid]) is None


def test_a_mark_tells_where_its_session_is_reached(network: Network) -> None:
    session = network.session()
    (mark,) = marks(network.rendezvous)
    assert (mark.pid, mark.zid) == (os.getpid(), session.zid)
    with socket.create_connection(("127.0.0.1", mark.port), 1):
        pass
    session.close()
    assert marks(network.rendezvous) == []


def test_a_mark_is_there_before_its_session(network: Network) -> None:
    one, other = Presence(network.rendezvous), Presence(network.rendezvous, reachable=False)
    assert one.others() == [other.mark]
    assert other.others() == [one.mark]
    assert other.mark.endpoint == ""
    one.tell("abc")
    assert [mark.zid for mark in other.others()] == ["abc"]
    one.close()
    other.close()
    assert marks(network.rendezvous) == []


def test_nobody_is_awake_where_all_are_stopped(network: Network) -> None:
    assert not is_anybody_awake(network.rendezvous)
    program = network.program(NODE, "a")
    program.wait_for("up")
    assert is_anybody_awake(network.rendezvous)
    assert why_unanswered(network.rendezvous) == ""
    stop(program)
    assert not is_anybody_awake(network.rendezvous)
    assert f"'kill -CONT {program.pid}'" in why_unanswered(network.rendezvous)
    program.send(signal.SIGCONT)
    eventually(lambda: is_anybody_awake(network.rendezvous), "it is awake again")


def test_sessions_that_are_out_of_reach(network: Network) -> None:
    programs = [network.program(NODE, name) for name in ("a", "b")]
    for program in programs:
        program.wait_for("up")
    session = network.session()
    assert session.out_of_reach() == set()
    stop(programs[1])
    stopped = {mark.zid for mark in marks(network.rendezvous) if mark.pid == programs[1].pid}
    assert session.out_of_reach() == stopped
    assert len(stopped) == 1


@pytest.mark.parametrize("held", ["core", "node"])
def test_sockets_of_the_program_are_left_alone(network: Network, held: str) -> None:
    """A session that closes next to who is stopped ends connections of its own only."""
    holder = network.program(NODE, "a") if held == "node" else network.run("-m", "rosz", "core")
    holder.wait_for("up" if held == "node" else "listening")
    stop(holder)
    beside = network.program(BESIDE)
    assert beside.wait_for("both") == "both b'ab'"
    assert beside.exit_code() == 0
    assert "Warning" not in beside.output
