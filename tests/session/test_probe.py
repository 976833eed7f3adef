"""Probing ports, and choosing among several endpoints."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator

import pytest
from network import TIMEOUT, WITHOUT_LIMITS, Network, free_port

from rosz.errors import TransportError
from rosz.session import Session, SessionConfig, first_listening

NOWHERE = "tcp/192.0.2.1:9"
"""An address that no machine has: connections fail or time out."""


@pytest.fixture
def served() -> Iterator[str]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture
def refused() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


def test_the_most_preferred_that_answers(served: str, refused: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        other = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        assert first_listening([served, other], 5) == served
        assert first_listening([other, served], 5) == other
        assert first_listening([refused, other], 5) == other


def test_an_unreachable_endpoint_does_not_delay_the_others(served: str) -> None:
    began = time.monotonic()
    assert first_listening([NOWHERE, served], 2 * TIMEOUT) == served
    assert time.monotonic() - began < TIMEOUT


def test_a_silent_endpoint_does_not_delay_the_end(network: Network, served: str) -> None:
    """A connection that nobody answers takes minutes."""
    program = network.program(
        f"""{WITHOUT_LIMITS}
    import socket
    from rosz.session import first_listening

    server = socket.create_server(("127.0.0.1", 0), backlog=0)
    waiting = [socket.socket() for _ in range(4)]  # more than it has room for
    for other in waiting:
        other.setblocking(False)
        other.connect_ex(server.getsockname())
    silent = f"tcp/127.0.0.1:{{server.getsockname()[1]}}"
    print(first_listening([silent, "{served}"], {4 * TIMEOUT}))
        """
    )
    assert program.wait_for("tcp") == served
    assert program.exit_code() == 0


def test_nobody_answers(refused: str) -> None:
    assert first_listening([refused, NOWHERE], 0.3) == ""


def test_one_that_comes_later(refused: str) -> None:
    place = refused.removeprefix("tcp/127.0.0.1:")
    servers: list[socket.socket] = []
    late = threading.Timer(
        0.2, lambda: servers.append(socket.create_server(("127.0.0.1", int(place))))
    )
    late.start()
    assert first_listening([refused], 10) == refused
    late.join()
    servers[0].close()


def test_a_client_of_several_places_goes_where_somebody_is(network: Network, refused: str) -> None:
    network.node("there")
    config = SessionConfig(
        mode="client", rendezvous=refused, connect=(network.rendezvous,), must_connect=True
    )
    with Session.open(config) as session:
        assert session.peers()


def test_a_client_of_several_places_where_nobody_is(refused: str) -> None:
    config = SessionConfig(
        mode="client", rendezvous=refused, connect=(refused,), must_connect=True, open_timeout=0.2
    )
    with pytest.raises(TransportError, match=r"nobody answers at 'tcp/.*' within 0\.2 s"):
        Session.open(config)
