from __future__ import annotations

import math
import signal
import threading
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network

from rosz.errors import (
    ClosedError,
    EncodeError,
    RoszError,
    ServiceError,
    ServiceNotFound,
    WaitTimeout,
)
from rosz.msgs.example_interfaces.srv import AddTwoInts, AddTwoIntsRequest, AddTwoIntsResponse
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Client, Node

SERVER = """
    import sys
    import time
    import rosz
    from rosz.msgs.example_interfaces.srv import AddTwoInts

    def handle(request):
        print("asked", request.a, flush=True)
        time.sleep(request.b)
        return request.a

    node = rosz.Node(sys.argv[1])
    node.service("slow", AddTwoInts, handle)
    print("ready", flush=True)
    node.spin()
"""


class Changed(AddTwoInts):
    """Another version of the service: same name, another definition."""

    _type_hash = "RIHS01_" + "ab" * 32


@pytest.fixture
def add(server: Node, caller: Node) -> Client:
    server.service("add", AddTwoInts, lambda request: request.a + request.b)
    client = caller.client("add", AddTwoInts)
    client.wait_for_service()
    return client


def outcome(call: object) -> RoszError | None:
    """Return the error that a call ends with."""
    assert callable(call)
    try:
        call()
    except RoszError as error:
        return error
    return None


def test_ways_to_call(add: Client) -> None:
    seven = AddTwoIntsResponse(7)
    assert add(AddTwoIntsRequest(3, 4)) == seven
    assert add(3, 4) == seven
    assert add(3, b=4) == seven
    assert add(a=3, b=4) == seven
    assert add.call(AddTwoIntsRequest(3, 4)) == seven


def test_what_does_not_fit(add: Client) -> None:
    with pytest.raises(EncodeError, match=r"example_interfaces/AddTwoIntsRequest.*\.a: .*'three'"):
        add("three", 4)
    with pytest.raises(EncodeError, match="'c'"):
        add(c=3)


@pytest.mark.usefixtures("add")
def test_unknown_service(caller: Node) -> None:
    client = caller.client("ad", AddTwoInts)
    with pytest.raises(
        ServiceNotFound, match=r"^service \[/ad\] is not available; did you mean '/add'\?$"
    ):
        client(1, 2)
    with pytest.raises(ServiceNotFound, match="/robot] is not available; nobody serves that name"):
        caller.client("robot", AddTwoInts)(1, 2)


@pytest.mark.usefixtures("add")
def test_other_type(caller: Node) -> None:
    with pytest.raises(
        ServiceNotFound,
        match=r"service \[/add\] is not available: node '/server' serves service '/add' with type"
        " 'example_interfaces/srv/AddTwoInts'",
    ):
        caller.client("add", Empty)()


@pytest.mark.usefixtures("add")
def test_other_definition(caller: Node) -> None:
    client = caller.client("add", Changed)
    with pytest.raises(ServiceNotFound, match="with another definition of"):
        client(1, 2)
    with pytest.raises(WaitTimeout, match=r"no service '/add' .* with another definition of"):
        client.wait_for_service(0.05)


def test_wait_for_service(network: Network, server: Node, caller: Node) -> None:
    client = caller.client("add", AddTwoInts)
    with pytest.raises(WaitTimeout, match=r"no service '/add' of type .* within 0\.05 s"):
        client.wait_for_service(0.05)
    waited = network.thread(client.wait_for_service)
    server.service("add", AddTwoInts, lambda _: 0)
    waited.join(TIMEOUT)
    assert not waited.is_alive()


def test_call_at_once(network: Network, server: Node) -> None:
    """A young process finds a server that others know: its calls wait until it is linked."""
    server.service("add", AddTwoInts, lambda request: request.a + request.b)
    for number in range(5):
        assert network.node(f"caller{number}").client("add", AddTwoInts)(1, 2).sum == 3


def test_timeout(server: Node, caller: Node) -> None:
    gate = threading.Event()
    server.service("slow", AddTwoInts, lambda _: int(gate.wait(TIMEOUT)))
    client = caller.client("slow", AddTwoInts, timeout=0.1)
    client.wait_for_service()
    for call, text in ((lambda: client(1, 2), "0.1"), (lambda: client(1, 2, timeout=0.2), "0.2")):
        error = outcome(call)
        assert isinstance(error, WaitTimeout)
        assert isinstance(error, TimeoutError)
        assert str(error) == (
            f"no answer of service '/slow' within {text} s; the server is busy, stopped or out of"
            " reach"
        )
    gate.set()


def test_closing_cancels_calls(network: Network, server: Node, caller: Node) -> None:
    inside, gate = threading.Semaphore(0), threading.Event()

    def slow(_request: object) -> int:
        inside.release()
        return int(gate.wait(TIMEOUT))

    server.service("slow", AddTwoInts, slow)
    client = caller.client("slow", AddTwoInts)
    client.wait_for_service()
    ends: SimpleQueue[RoszError | None] = SimpleQueue()
    for _ in range(3):
        network.thread(lambda: ends.put(outcome(lambda: client(1, 2))))
        assert inside.acquire(timeout=TIMEOUT)
    caller.context.close()
    for _ in range(3):
        error = ends.get(timeout=TIMEOUT)
        assert isinstance(error, ClosedError)
        assert str(error) == "the call of '/slow' was cancelled: shutting down"
    with pytest.raises(ClosedError, match=r"the client of .* is closed"):
        client(1, 2)
    gate.set()


def test_server_is_killed_during_a_call(network: Network, caller: Node) -> None:
    """The call ends at once, and is made once: the work may have been done."""
    program = network.program(SERVER, "victim")
    client = caller.client("slow", AddTwoInts)
    client.wait_for_service(TIMEOUT)
    ends: SimpleQueue[RoszError | None] = SimpleQueue()
    network.thread(lambda: ends.put(outcome(lambda: client(7, 60))))
    program.wait_for("asked 7")
    program.kill()
    error = ends.get(timeout=TIMEOUT)  # the link is not given up before
    assert isinstance(error, ServiceError)
    assert str(error) == "service [/slow]: the server ended before it answered"
    assert program.output.count("asked") == 1
    caller.context.graph.wait_for(lambda view: not view.servers("/slow"), TIMEOUT, "its end")
    with pytest.raises(ServiceNotFound):
        client(1, 2)


def test_server_is_stopped(network: Network, caller: Node) -> None:
    program = network.program(SERVER, "sleeper")
    client = caller.client("slow", AddTwoInts)
    client.wait_for_service(TIMEOUT)
    program.send(signal.SIGSTOP)
    with pytest.raises(WaitTimeout, match="the server is busy, stopped or out of reach"):
        client(7, 0, timeout=0.3)
    program.send(signal.SIGCONT)
    assert client(8, 0).sum == 8


def test_several_servers(network: Network, caller: Node) -> None:
    """The first answer counts, and one that dies leaves the others."""
    program = network.program(SERVER, "mortal")
    caller.context.graph.wait_for_service("/slow", TIMEOUT)
    network.node("immortal").service("slow", AddTwoInts, lambda _: 42)
    client = caller.client("slow", AddTwoInts)
    caller.context.graph.wait_for(
        lambda view: len(view.servers("/slow")) == 2, TIMEOUT, "two servers"
    )
    assert client(7, 60).sum == 42
    program.kill()
    assert client(7, 60).sum == 42


def test_calls_from_callbacks_of_every_kind(network: Network, server: Node) -> None:
    """A timer, a subscription, a connection, a service and a hook: all may call, even itself."""
    from rosz.msgs.std_msgs.msg import Int32

    node = network.node("busy")
    got: SimpleQueue[tuple[str, int]] = SimpleQueue()
    server.service("double", AddTwoInts, lambda request: 2 * request.a)
    client = node.client("double", AddTwoInts)
    client.wait_for_service()

    def recurse(request: AddTwoIntsRequest) -> int:
        return 0 if request.a == 0 else int(itself(request.a - 1, 0).sum) + 1

    node.service("recurse", AddTwoInts, recurse)
    itself = node.client("recurse", AddTwoInts)
    itself.wait_for_service()
    publisher = node.publisher("count", Int32)
    publisher.on_connection(lambda _: got.put(("connection", client(1, 0).sum)))
    node.subscription("count", Int32, lambda m: got.put(("subscription", client(m.data, 0).sum)))
    node.timer(0.001, lambda _: got.put(("timer", client(3, 0).sum)), oneshot=True)
    node.on_shutdown(lambda _: got.put(("hook", client(4, 0).sum)))
    publisher.wait_for_subscribers()
    publisher.publish(2)
    assert itself(5, 0).sum == 5
    assert {got.get(timeout=TIMEOUT) for _ in range(3)} == {
        ("connection", 2),
        ("subscription", 4),
        ("timer", 6),
    }
    node.close()
    assert got.get(timeout=TIMEOUT) == ("hook", 8)


def test_who_waits_forever_waits(server: Node, caller: Node) -> None:
    client = caller.client("add", AddTwoInts, timeout=math.inf)
    server.service("add", AddTwoInts, lambda request: request.a + request.b)
    client.wait_for_service(math.inf)
    assert client(1, 2).sum == 3
    assert client(3, 4, timeout=math.inf).sum == 7
