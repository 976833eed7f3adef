from __future__ import annotations

import threading
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import EncodeError, ServiceError, UsageError
from rosz.msgs.example_interfaces.srv import AddTwoInts, AddTwoIntsRequest, AddTwoIntsResponse
from rosz.msgs.std_srvs.srv import Empty, EmptyRequest, SetBool, SetBoolResponse
from rosz.node import Node
from rosz.node.service import to_response


@pytest.mark.parametrize(
    "result",
    [
        SetBoolResponse(True, "done"),
        [True, "done"],
        (True, "done"),
        {"success": True, "message": "done"},
    ],
)
def test_what_a_handler_may_return(result: object) -> None:
    assert to_response(SetBool.Response, result) == SetBoolResponse(True, "done")


def test_short_forms() -> None:
    assert to_response(AddTwoInts.Response, 3) == AddTwoIntsResponse(3)
    assert to_response(AddTwoInts.Response, [3]) == AddTwoIntsResponse(3)
    assert to_response(SetBool.Response, {}) == SetBoolResponse()
    assert to_response(Empty.Response, None) == Empty.Response()
    assert to_response(Empty.Response, []) == Empty.Response()


@pytest.mark.parametrize(
    ("response", "result", "text"),
    [
        (SetBool.Response, None, "got NoneType None, expected .* values for success, message"),
        (SetBool.Response, [True], r"got list \[True\]"),
        (SetBool.Response, {"sucess": True}, "sucess"),
        (SetBool.Response, 3, "got int 3"),
        (Empty.Response, 3, "expected a response, or values for no fields"),
    ],
)
def test_what_is_no_response(response: Any, result: object, text: str) -> None:
    with pytest.raises(EncodeError, match=text):
        to_response(response, result)


def test_request_and_response(server: Node, caller: Node) -> None:
    requests: SimpleQueue[AddTwoIntsRequest] = SimpleQueue()

    def add(request: AddTwoIntsRequest) -> int:
        requests.put(request)
        return request.a + request.b

    server.service("add", AddTwoInts, add)
    client = caller.client("add", AddTwoInts)
    client.wait_for_service()
    assert client(3, 4) == AddTwoIntsResponse(7)
    assert requests.get(timeout=TIMEOUT) == AddTwoIntsRequest(3, 4)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ValueError("no such thing"), "no such thing"),
        (SystemExit(3), "3"),
        (KeyError("x"), "'x'"),
        (KeyboardInterrupt("stop"), "stop"),
    ],
)
def test_exception_arrives_and_is_logged(
    server: Node, caller: Node, capfd: pytest.CaptureFixture[str], error: BaseException, text: str
) -> None:
    def fail(_request: object) -> None:
        raise error

    server.service("fail", Empty, fail, threads=1)
    client = caller.client("fail", Empty)
    client.wait_for_service()
    for _ in range(2):
        with pytest.raises(
            ServiceError,
            match=rf"^service \[/fail\] responded with an error: error processing request: {text}$",
        ):
            client()
    server.close()
    written = capfd.readouterr().err
    assert written.count("handler of service '/fail' failed") == 2
    assert type(error).__name__ in written


def test_a_refusal_arrives_and_is_not_logged(
    server: Node, caller: Node, capfd: pytest.CaptureFixture[str]
) -> None:
    def refuse(_: object) -> None:
        raise ServiceError("not now")

    server.service("work", Empty, refuse)
    client = caller.client("work", Empty)
    client.wait_for_service()
    with pytest.raises(ServiceError, match=r"with an error: .*request: not now$"):
        client.call(EmptyRequest())
    server.close()
    assert "not now" not in capfd.readouterr().err


def test_invalid_response_arrives_and_is_logged(server: Node, caller: Node) -> None:
    server.service("switch", SetBool, lambda _: 3)
    server.service("add", AddTwoInts, lambda _: "three")
    caller.client("switch", SetBool).wait_for_service()
    with pytest.raises(ServiceError, match=r"handler returned invalid value: .*got int 3"):
        caller.client("switch", SetBool)(True)
    with pytest.raises(ServiceError, match=r"handler returned invalid value: .*'three'"):
        caller.client("add", AddTwoInts)(1, 2)


def test_several_calls_at_once(network: Network, server: Node, caller: Node) -> None:
    """As many as there are threads run together; the others wait their turn."""
    together = threading.Barrier(4)

    def meet(request: AddTwoIntsRequest) -> int:
        together.wait(TIMEOUT)
        return request.a

    server.service("meet", AddTwoInts, meet, threads=4)
    client = caller.client("meet", AddTwoInts)
    client.wait_for_service()
    answers: SimpleQueue[int] = SimpleQueue()
    for number in range(8):
        network.thread(lambda n=number: answers.put(client(n, 0).sum))  # type: ignore[misc]
    assert sorted(answers.get(timeout=TIMEOUT) for _ in range(8)) == list(range(8))


def test_many_calls_of_many_clients(network: Network, server: Node) -> None:
    server.service("add", AddTwoInts, lambda request: request.a + request.b)
    wrong: SimpleQueue[object] = SimpleQueue()
    done: SimpleQueue[int] = SimpleQueue()

    def work(client: Any, start: int) -> None:
        client.wait_for_service()
        for number in range(50):
            answer = client(start, number)
            if answer.sum != start + number:
                wrong.put((start, number, answer))
        done.put(start)

    callers = [network.node(f"caller{n}").client("add", AddTwoInts) for n in range(3)]
    for number, client in enumerate(callers * 2):
        network.thread(lambda c=client, n=number: work(c, n * 1000))  # type: ignore[misc]
    for _ in range(6):
        done.get(timeout=TIMEOUT)
    assert wrong.empty()


def test_closing_refuses_further_calls(network: Network, server: Node, caller: Node) -> None:
    """The call that is being handled gets its answer."""
    inside, go_on = threading.Event(), threading.Event()

    def slow(_request: object) -> int:
        inside.set()
        assert go_on.wait(TIMEOUT)
        return 42

    service = server.service("slow", AddTwoInts, slow)
    client = caller.client("slow", AddTwoInts)
    client.wait_for_service()
    answers: SimpleQueue[int] = SimpleQueue()
    network.thread(lambda: answers.put(client(0, 0).sum))
    assert inside.wait(TIMEOUT)
    service.close()
    service.close()
    go_on.set()
    assert answers.get(timeout=TIMEOUT) == 42
    view = caller.context.graph
    eventually(lambda: not view.view().servers("/slow"), "the service is gone from the graph")
    with pytest.raises(ServiceError, match=r"service \[/slow\] is not available"):
        client(0, 0)


def test_closed_in_its_own_handler(server: Node, caller: Node) -> None:
    def once(_request: object) -> int:
        service.close()
        return 1

    service = server.service("once", AddTwoInts, once)
    client = caller.client("once", AddTwoInts)
    client.wait_for_service()
    assert client(0, 0).sum == 1


@pytest.mark.parametrize("threads", [0, -1, 2.5])
def test_no_such_number_of_threads(server: Node, threads: Any) -> None:
    with pytest.raises(UsageError, match=f"threads is {threads}: expected 1 or more"):
        server.service("add", AddTwoInts, lambda _: 0, threads=threads)


def threads_for(name: str) -> list[str]:
    """Return the names of the threads that serve or follow a name."""
    return [one.name for one in threading.enumerate() if name in one.name]


def test_threads_end_with_the_service(server: Node) -> None:
    name = "total"  # not in the id of any session, which is hexadecimal
    service = server.service(name, AddTwoInts, lambda _: 0)
    client = server.client(name, AddTwoInts)
    client.wait_for_service()
    client(0, 0)
    assert len(threads_for(name)) > 1
    client.close()  # it follows the servers
    service.close()
    eventually(lambda: not threads_for(name), "its threads ended")
