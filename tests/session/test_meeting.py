"""The first process holds the rendezvous, even if two start at the same moment."""

from __future__ import annotations

import secrets
import socket

import pytest
import zenoh
from network import Network, eventually, free_port, repeats

from rosz.session import Session, SessionConfig, is_listening
from rosz.session.config import new_id

PEER = """
    import sys
    from rosz.environment import Environment
    from rosz.session import Session, SessionConfig

    config = SessionConfig.node(Environment.read())
    print("ready", flush=True)
    sys.stdin.readline()
    with Session.open(config) as session:
        print("open", flush=True)
        while not session.peers():
            pass
        print("met", flush=True)
        sys.stdin.readline()
"""


def test_two_at_the_same_moment(network: Network) -> None:
    for _ in range(repeats(15, 300)):
        network.rendezvous = f"tcp/127.0.0.1:{free_port()}"
        pair = [network.program(PEER) for _ in range(2)]
        for program in pair:
            program.wait_for("ready")
        for program in pair:
            program.say("go")
        for program in pair:
            program.wait_for("met")
        for program in pair:
            program.say("enough")
            assert program.exit_code() == 0
            program.close()


def test_refused_at_first(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """The port is refused as Linux refuses it to two processes that listen at the same moment."""
    port = free_port()
    network.rendezvous = f"tcp/127.0.0.1:{port}"
    opened = []
    open_session = zenoh.open

    def refused_once(settings: zenoh.Config) -> zenoh.Session:
        opened.append(settings)
        if len(opened) > 1:
            return open_session(settings)
        with socket.socket() as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            other.bind(("127.0.0.1", port))
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)  # others may not listen
            return open_session(settings)

    monkeypatch.setattr(zenoh, "open", refused_once)
    with Session.open(SessionConfig.node(network.environment())):
        assert len(opened) == 2
        assert is_listening(network.rendezvous)


def test_a_configuration_that_does_not_listen_there(network: Network) -> None:
    environment = network.environment(zenoh_override='listen/endpoints=["tcp/127.0.0.1:0"]')
    with Session.open(SessionConfig.node(environment)):
        assert not is_listening(network.rendezvous)


def test_an_older_session_connects_to_a_newer_one(network: Network) -> None:
    """Of two peers, the one with the greater id connects; Zenoh compares the last byte first."""
    here = SessionConfig.node(network.environment())
    first = new_id(here)
    eventually(lambda: bytes.fromhex(new_id(here))[::-1] < bytes.fromhex(first)[::-1], "a later id")
    everybody = secrets.token_hex(16)
    assert bytes.fromhex(new_id(here))[::-1] > bytes.fromhex(everybody)[::-1]
    beyond = SessionConfig.node(network.environment(listen=("tcp/0.0.0.0:0",)))
    told = SessionConfig.node(network.environment(zenoh_override='connect/endpoints=["tcp/a:7"]'))
    for settings in (beyond, told):
        assert bytes.fromhex(new_id(here))[::-1] > bytes.fromhex(new_id(settings))[::-1]
    with Session.open(here) as one, Session.open(here) as other:
        assert bytes.fromhex(one.zid)[::-1] > bytes.fromhex(other.zid)[::-1]
        eventually(lambda: one.peers() == [other.zid], "a link")


def test_the_id_of_a_configuration(network: Network) -> None:
    environment = network.environment(zenoh_override='id="1234abcd"')
    with Session.open(SessionConfig.node(environment)) as session:
        assert session.zid == "1234abcd"
