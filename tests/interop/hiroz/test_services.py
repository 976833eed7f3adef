"""Services in both directions: answers, errors, silence, many calls at once."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from network import TIMEOUT

from rosz.errors import ServiceError, WaitTimeout
from rosz.msgs.example_interfaces.srv import AddTwoInts, AddTwoIntsRequest
from rosz.node import Client

from .city import City, Peer

CALLS = 50
LIMIT = int(TIMEOUT * 1000)


@pytest.fixture
def client(city: City, peer: Peer) -> Client:
    """A client of hiroz' server, which never answers where the first number is negative."""
    peer.do("serve", "/add")
    made = city.node("caller").client("add", AddTwoInts, timeout=TIMEOUT)
    made.wait_for_service(TIMEOUT)
    return made


def test_calling_its_server(client: Client, peer: Peer) -> None:
    assert client(20, 22).sum == 42
    assert peer.next("asked") == [20, 22]
    assert client(2**62, -(2**62)).sum == 0
    with pytest.raises(ServiceError, match=r"/partner dropped the request unanswered"):
        client(-1, 0)
    assert client(1, 1).sum == 2


def test_many_calls_of_its_server(client: Client) -> None:
    """It keeps 10 requests and drops older ones, so not more may be on their way."""
    with ThreadPoolExecutor(CALLS) as pool:
        answers = pool.map(lambda number: client(number, 1).sum, range(CALLS))
        assert [*answers] == [*range(1, CALLS + 1)]


def test_its_server_ends(client: Client, peer: Peer) -> None:
    assert client(1, 1).sum == 2
    peer.program.kill()
    client.others.wait_for(lambda view: not view.servers("/add"), TIMEOUT, "no server")
    with pytest.raises(ServiceError):
        client(1, 1)


def test_serving_its_client(city: City, peer: Peer) -> None:
    """Answers, an error, a late answer, a server that is gone."""
    over = threading.Event()

    def add(request: AddTwoIntsRequest) -> int:
        if request.a < 0:
            raise ValueError("nothing below zero")
        if request.a == 7:
            over.wait(TIMEOUT)
        return request.a + request.b

    server = city.node("adder").service("add", AddTwoInts, add)
    try:
        peer.wait_for_service("/add")
        assert peer.ask("answer /add", "call", "/add", 20, 22, LIMIT) == 42
        assert "ended" in peer.ask("failed /add", "call", "/add", -1, 0, LIMIT)
        assert peer.ask("late /add", "call", "/add", 7, 0, 200) == 7
        assert peer.ask("answer /add", "call", "/add", 1, 0, LIMIT) == 1
    finally:
        over.set()
    for number in range(CALLS):
        peer.tell("call", "/add", number, 100, LIMIT)
    answers = {peer.next("answer /add") for _ in range(CALLS)}
    assert answers == {*range(100, 100 + CALLS)}
    server.close()
    peer.ask("failed /add", "call", "/add", 1, 0, LIMIT)


def test_wait_times_out(client: Client, peer: Peer) -> None:
    """A server that is stopped: the caller is told in time."""
    peer.program.send(signal.SIGSTOP)
    os.waitid(os.P_PID, peer.program.pid, os.WSTOPPED)
    try:
        with pytest.raises(WaitTimeout, match="busy, stopped or out of reach"):
            client(1, 1, timeout=0.3)
    finally:
        peer.program.send(signal.SIGCONT)
    assert client(1, 1).sum == 2
