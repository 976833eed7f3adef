"""The machines of these tests are what they claim to be."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from network import eventually

from hosts.world import Host, World

SERVER = """
    import socket, sys
    server = socket.create_server(("0.0.0.0", 5000))
    print("listening", flush=True)
    connection, _ = server.accept()
    while data := connection.recv(65536):
        connection.sendall(data)
"""


def reaches(host: Host, name: str, seconds: float = 1.0) -> bool:
    """Tell whether a connection to a host comes about, be it to be refused."""
    program = host.program(
        f"""
        import socket
        try:
            socket.create_connection(({name!r}, 9), {seconds})
        except ConnectionRefusedError:
            print("reached")
        except OSError as error:
            print(error)
        """
    )
    program.exit_code()
    return "reached" in program.output


def test_hosts_have_names_homes_and_processes_of_their_own(world: World) -> None:
    one, other = world.hosts("one", "other")
    assert one.run("hostname") == "one\n"
    show = "import os, pwd; print(os.getpid(), os.path.expanduser('~'), pwd.getpwuid(0).pw_dir)"
    program = one.program(show)
    program.exit_code()
    _, home, of_account = program.output.split()
    assert home == of_account == str(one.home) != str(other.home)
    one.execute("sleep", "60")
    eventually(lambda: one.processes() == ["sleep 60"], "the process there")
    assert not other.processes()
    assert reaches(one, "other")
    assert not one.listening()


def test_a_link_is_cut_and_healed(world: World) -> None:
    one, other, third = world.hosts("one", "other", "third")
    assert reaches(one, "other")
    other.link.cut()
    assert not reaches(one, "other", 0.3)
    assert reaches(one, "third")
    assert "LOWER_UP" in other.run("ip", "link", "show", "eth0")
    other.link.heal()
    assert reaches(one, "other")
    other.link.unplug()
    assert "NO-CARRIER" in other.run("ip", "link", "show", "eth0")
    other.link.heal()
    eventually(lambda: reaches(third, "other"), "healed")


def test_a_bad_link_delays_and_loses(world: World) -> None:
    if not Path("/dev/net/tun").exists():
        pytest.skip("bad links need /dev/net/tun")
    one, other = world.hosts("one", "other")
    server = other.program(SERVER)
    server.wait_for("listening")
    other.link.degrade(delay=0.1)
    client = one.program(
        """
        import socket, time
        connection = socket.create_connection(("other", 5000))
        print("connected", flush=True)
        while True:
            input()
            began = time.monotonic()
            connection.sendall(b"x")
            connection.recv(1)
            print(f"echo {time.monotonic() - began:.4f}", flush=True)
        """
    )
    client.wait_for("connected")

    def echo() -> float:
        count = len(client.lines)
        client.say("")
        return float(client.wait_for("echo", after=count).split()[1])

    assert min(echo() for _ in range(3)) >= 0.2
    other.link.heal()
    eventually(lambda: echo() < 0.2, "an echo without delay")
    other.link.degrade(loss=1)
    assert not reaches(one, "other", 0.3)
    other.link.heal()
    assert reaches(one, "other")


def test_a_host_dies_with_all_it_runs(world: World) -> None:
    one, other = world.hosts("one", "other")
    sleeper = one.execute("sleep", "60")
    one.kill()
    assert sleeper.exit_code() == -signal.SIGKILL
    assert not one.processes()
    one.power_off()
    assert not reaches(other, "one", 0.3)


def test_signals_reach_the_program(world: World) -> None:
    (one,) = world.hosts("one")
    program = one.program(
        """
        import signal
        signal.signal(signal.SIGINT, lambda *_: print("int", flush=True))
        print("ready", flush=True)
        while True:
            signal.pause()
        """
    )
    program.wait_for("ready")
    program.send(signal.SIGSTOP)
    program.send(signal.SIGINT)
    program.send(signal.SIGCONT)
    program.wait_for("int")
    program.kill()


def test_nothing_is_left() -> None:
    with World() as world:
        host = world.host("one")
        host.execute("sleep", "60")
        inside = Path(f"/proc/{host.namespace.pid}")
        folder = world.folder
    assert not inside.exists()
    assert not folder.exists()
