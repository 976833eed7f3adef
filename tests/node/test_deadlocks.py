"""Any call from any callback: whatever it is, it neither hangs nor holds the others up."""

from __future__ import annotations

import faulthandler
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, repeats

from rosz import lifecycle
from rosz.errors import ClosedError, RoszError
from rosz.msgs.example_interfaces.srv import AddTwoInts, AddTwoIntsRequest
from rosz.msgs.std_msgs.msg import Int32
from rosz.node import Node
from rosz.worker import Worker

WATCHDOG = TIMEOUT
ROUNDS = repeats(4, 50)

PARTNER = """
    import rosz
    from rosz.msgs.example_interfaces.srv import AddTwoInts
    from rosz.msgs.std_msgs.msg import Int32

    node = rosz.Node("partner")
    back = node.publisher("back", Int32)
    node.subscription("out", Int32, lambda m: back.publish(m.data + 1), queue_size=100)
    ask_back = node.client("subject/twice", AddTwoInts)
    node.service("twice", AddTwoInts, lambda request: 2 * request.a)
    node.service("back", AddTwoInts, lambda request: ask_back(request.a, 0).sum + 1)
    print("ready", flush=True)
    node.spin()
"""


def play_partner(node: Node) -> None:
    """Run the program on a node of this process."""
    back = node.publisher("back", Int32)
    node.subscription("out", Int32, lambda m: back.publish(m.data + 1), queue_size=100)
    ask_back = node.client("subject/twice", AddTwoInts)
    node.service("twice", AddTwoInts, lambda request: 2 * request.a)
    node.service("back", AddTwoInts, lambda request: ask_back(request.a, 0).sum + 1)


class Subject:
    """The node under test, and the results of its callbacks."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.got: SimpleQueue[Any] = SimpleQueue()

    def wait(self, count: int = 1) -> list[Any]:
        return [self.got.get(timeout=WATCHDOG) for _ in range(count)]

    def publish(self, topic: str, value: int) -> None:
        publisher = self.node.publisher(topic, Int32)
        publisher.wait_for_subscribers(timeout=WATCHDOG)
        publisher.publish(value)

    def client(self, name: str) -> Callable[[int], int]:
        client = self.node.client(name, AddTwoInts, timeout=WATCHDOG)
        client.wait_for_service(WATCHDOG)
        return lambda value: int(client(value, 0).sum)

    def serve(self, name: str, handler: Callable[[int], int]) -> None:
        def handle(request: AddTwoIntsRequest) -> int:
            return handler(request.a)

        self.node.service(name, AddTwoInts, handle)


def publishes_on_its_own_topic(it: Subject) -> None:
    publisher = it.node.publisher("loop", Int32)

    def callback(message: Int32) -> None:
        if message.data < 20:
            publisher.publish(message.data + 1)
        else:
            it.got.put(message.data)

    it.node.subscription("loop", Int32, callback)
    it.publish("loop", 0)
    assert it.wait() == [20]


def publishes_on_another_topic(it: Subject) -> None:
    out = it.node.publisher("out", Int32)

    def callback(message: Int32) -> None:
        if message.data < 20:
            out.publish(message.data + 1)
        else:
            it.got.put(message.data)

    it.node.subscription("back", Int32, callback)
    out.wait_for_subscribers(timeout=WATCHDOG)
    it.node.context.graph.wait_for_topic("/back", WATCHDOG)
    out.publish(0)
    assert it.wait()[0] >= 20


def calls_its_own_service(it: Subject) -> None:
    it.serve("~own", lambda value: value + 1)
    ask = it.client("~own")
    it.node.subscription("ask", Int32, lambda m: it.got.put(ask(m.data)))
    it.publish("ask", 7)
    assert it.wait() == [8]


def calls_another_service(it: Subject) -> None:
    ask = it.client("twice")
    it.node.subscription("ask", Int32, lambda m: it.got.put(ask(m.data)))
    it.publish("ask", 7)
    assert it.wait() == [14]


def service_calls_a_service(it: Subject) -> None:
    """The other one calls back, too: there and back again before the first call ends."""
    it.serve("subject/twice", lambda value: 2 * value)
    ask = it.client("back")
    it.serve("~outer", lambda value: ask(value) + 1)
    outer = it.client("~outer")
    assert outer(7) == 16


def service_calls_itself(it: Subject) -> None:
    it.serve("~self", lambda value: 0 if value == 0 else ask(value - 1) + 1)
    ask = it.client("~self")
    assert ask(10) == 10


def timer_publishes_and_calls(it: Subject) -> None:
    ask = it.client("twice")
    out = it.node.publisher("out", Int32)
    out.wait_for_subscribers(timeout=WATCHDOG)
    it.node.subscription("back", Int32, lambda m: it.got.put(m.data))
    it.node.context.graph.wait_for_topic("/back", WATCHDOG)

    def tick(_event: object) -> None:
        out.publish(ask(5))

    it.node.timer(0.005, tick)
    assert set(it.wait(3)) == {11}


def callback_unsubscribes_itself(it: Subject) -> None:
    def callback(message: Int32) -> None:
        subscription.close()
        it.got.put(message.data)

    subscription = it.node.subscription("once", Int32, callback)
    it.publish("once", 1)
    assert it.wait() == [1]
    assert subscription.closed


def callback_shuts_down(it: Subject) -> None:
    def callback(_message: Int32) -> None:
        it.node.context.shutdown("enough")
        it.got.put(it.node.is_shutdown)

    it.node.subscription("stop", Int32, callback)
    it.publish("stop", 1)
    assert it.wait() == [True]


def handler_shuts_down(it: Subject) -> None:
    def handle(value: int) -> int:
        it.node.close()
        it.got.put("closed")
        return value

    it.serve("~stop", handle)
    client = it.node.client("~stop", AddTwoInts, timeout=WATCHDOG)
    client.wait_for_service(WATCHDOG)
    try:
        client(1, 0)
    except RoszError as error:
        it.got.put(type(error))
    assert it.wait()[0] in {"closed", ClosedError}


def timer_shuts_down(it: Subject) -> None:
    def tick(_event: object) -> None:
        it.node.context.close()
        it.got.put("closed")

    it.node.timer(0.001, tick)
    assert it.wait() == ["closed"]


def callback_raises(it: Subject) -> None:
    def callback(message: Int32) -> None:
        it.got.put(message.data)
        raise ValueError("on purpose")

    it.node.subscription("bad", Int32, callback)
    publisher = it.node.publisher("bad", Int32)
    publisher.wait_for_subscribers(timeout=WATCHDOG)
    for number in range(3):
        publisher.publish(number)
    assert it.wait(3) == [0, 1, 2]


def callback_sleeps(it: Subject) -> None:
    """Others go on meanwhile, and the end does not wait for it."""
    asleep = threading.Event()
    ask = it.client("twice")

    def callback(_message: Int32) -> None:
        asleep.set()
        it.node.sleep(1000)

    it.node.subscription("sleep", Int32, callback)
    it.node.subscription("sleep", Int32, lambda m: it.got.put(ask(m.data)))
    it.publish("sleep", 3)
    assert asleep.wait(WATCHDOG)
    assert it.wait() == [6]
    it.node.context.close()


def hook_publishes_and_calls(it: Subject) -> None:
    ask = it.client("twice")
    it.node.on_shutdown(lambda _: it.got.put(ask(4)))
    it.node.subscription("end", Int32, lambda _: it.node.close())
    it.publish("end", 1)
    assert it.wait() == [8]


SCENES = [
    publishes_on_its_own_topic,
    publishes_on_another_topic,
    calls_its_own_service,
    calls_another_service,
    service_calls_a_service,
    service_calls_itself,
    timer_publishes_and_calls,
    callback_unsubscribes_itself,
    callback_shuts_down,
    handler_shuts_down,
    timer_shuts_down,
    callback_raises,
    callback_sleeps,
    hook_publishes_and_calls,
]


def watched(scene: Callable[[Subject], None], node: Node) -> None:
    """Play a scene on a thread of its own, and bark when it does not end in time."""
    failed: list[BaseException] = []
    ended = threading.Event()

    def play() -> None:
        try:
            scene(Subject(node))
            node.context.close()
        except BaseException as error:  # noqa: BLE001  # raised again by the test
            failed.append(error)
        ended.set()

    threading.Thread(target=play, daemon=True).start()
    if not ended.wait(WATCHDOG):
        faulthandler.dump_traceback()
        pytest.fail(f"'{scene.__name__}' hangs")
    if failed:
        raise failed[0]


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("partner", ["same session", "other session", "other process"])
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: str(scene.__name__))
def test_no_call_hangs(
    network: Network,
    monkeypatch: pytest.MonkeyPatch,
    scene: Callable[[Subject], None],
    partner: str,
) -> None:
    """Nor does a scene end only because something gives up waiting."""
    monkeypatch.setattr(lifecycle, "_CLOSE_TIMEOUT", 1000.0)
    monkeypatch.setattr(Worker.close, "__defaults__", (1000.0,))
    if partner == "other process":
        network.program(PARTNER).wait_for("ready", TIMEOUT)
    elif partner == "other session":
        play_partner(network.node("partner"))
    for _ in range(ROUNDS):
        node = network.node("subject")
        if partner == "same session":
            play_partner(network.node("partner", context=node.context))
        watched(scene, node)
