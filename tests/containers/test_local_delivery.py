"""Messages between nodes of one process: the messages themselves, or copies."""

from __future__ import annotations

import threading
import time
from queue import SimpleQueue
from typing import Any

import pytest
from network import Network, eventually

from rosz.errors import EncodeError
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.std_msgs.msg import String
from rosz.node import Context, LocalDelivery, Node, subscription


@pytest.fixture
def context(network: Network) -> Context:
    shared = network.context()
    shared.local_delivery = LocalDelivery()
    return shared


def _receiver(context: Context, name: str, **options: Any) -> tuple[Node, SimpleQueue[Any]]:
    node, came = Node(name, context=context), SimpleQueue[Any]()
    node.subscription("topic", options.pop("kind", Image), came.put, **options)
    return node, came


def test_the_message_itself_arrives_and_only_once(context: Context) -> None:
    _, one = _receiver(context, "one")
    _, two = _receiver(context, "two")
    publisher = Node("talker", context=context).publisher("topic", Image)
    message = Image(width=3)
    publisher.publish(message)
    assert one.get(timeout=60) is message
    assert two.get(timeout=60) is message
    assert message.header.seq == 1
    publisher.publish(Image(width=4))
    assert one.get(timeout=60).width == 4  # nothing came twice


def test_copies_are_taken_when_the_message_is_published(context: Context) -> None:
    _, one = _receiver(context, "one")
    publisher = Node("talker", context=context).publisher("topic", Image, copies=True)
    message = Image(width=3, data=b"abc")
    publisher.publish(message)
    message.width = 99
    came = one.get(timeout=60)
    assert came is not message
    assert (came.width, came.data) == (3, b"abc")
    message.width = -1
    with pytest.raises(EncodeError):
        publisher.publish(message)


def test_others_receive_it_by_the_session(network: Network, context: Context) -> None:
    publisher = Node("talker", context=context).publisher("topic", Image)
    far = network.node("far").subscription("topic", Image)
    _, near = _receiver(context, "near")
    publisher.wait_for_subscribers(2)
    message = Image(width=7)
    publisher.publish(message)
    assert far.get().width == 7
    assert near.get(timeout=60) is message


def test_late_subscriptions_receive_what_is_latched_once(context: Context) -> None:
    talker = Node("talker", context=context)
    publisher = talker.publisher("topic", String, latch=True)
    publisher.publish(data="before")
    _, early = _receiver(context, "early", kind=String)
    assert early.get(timeout=60).data == "before"
    for number in range(20):
        publisher.publish(data=str(number))
        assert early.get(timeout=60).data == str(number)
    publisher.publish(data="last")
    assert early.get(timeout=60).data == "last"
    assert early.empty()


def test_a_subscription_of_any_type_and_of_bytes(context: Context) -> None:
    _, untyped = _receiver(context, "untyped", kind=None)
    _, raw = _receiver(context, "raw", kind=String, raw=True)
    publisher = Node("talker", context=context).publisher("topic", String)
    publisher.publish(data="x")
    assert untyped.get(timeout=60).data == "x"
    encoded = raw.get(timeout=60)
    assert encoded == String(data="x").to_cdr()
    publisher.publish_raw(encoded)
    assert untyped.get(timeout=60).data == "x"


def test_a_callback_that_blocks_holds_nobody_up(context: Context) -> None:
    blocked, release = threading.Event(), threading.Event()

    def block(_: object) -> None:
        blocked.set()
        release.wait(60)

    slow = Node("slow", context=context).subscription("topic", Image, block, queue_size=3)
    _, quick = _receiver(context, "quick")
    publisher = Node("talker", context=context).publisher("topic", Image)
    publisher.publish(Image())
    assert blocked.wait(60)
    quick.get(timeout=60)
    for number in range(10):
        publisher.publish(Image(width=number))
    assert quick.get(timeout=60).width == 0
    release.set()
    eventually(lambda: slow.dropped == 7)


class _Clock:
    """The module time, which counts how often a thread sleeps.

    Args:
        thread: The thread.
    """

    def __init__(self, thread: threading.Thread) -> None:
        self.sleeps = 0
        self._thread = thread

    def sleep(self, seconds: float) -> None:
        if threading.current_thread() is self._thread:
            self.sleeps += 1
        time.sleep(seconds)

    def __getattr__(self, name: str) -> Any:
        return getattr(time, name)


def test_a_publisher_lets_callbacks_take_what_fills_the_queue(
    context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = _Clock(threading.current_thread())
    monkeypatch.setattr(subscription, "time", clock)
    began, go_on, came = threading.Event(), threading.Event(), SimpleQueue[str]()

    def callback(message: String) -> None:
        began.set()
        go_on.wait(60)
        came.put(message.data)

    Node("slow", context=context).subscription("topic", String, callback, queue_size=100)
    publisher = Node("fast", context=context).publisher("topic", String)
    publisher.publish(data="first")
    assert began.wait(60)
    for number in range(99):
        publisher.publish(data=str(number))
    assert clock.sleeps == 0  # there is room for another one
    for number in range(99, 350):
        publisher.publish(data=str(number))
    assert clock.sleeps == 3  # once for each 100 at most
    go_on.set()
    assert came.get(timeout=60) == "first"
    assert [came.get(timeout=60) for _ in range(100)] == [str(number) for number in range(250, 350)]
