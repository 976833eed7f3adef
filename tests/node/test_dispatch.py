"""Many subscriptions share few threads, and no callback holds up another."""

from __future__ import annotations

import threading
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz import worker
from rosz.msgs.std_msgs.msg import Empty, Int32
from rosz.node import MessageInfo, Node
from rosz.session import declared

MANY = 150
MORE_THREADS = 30


@pytest.mark.parametrize("how", ["callback", "no callback", "any type"])
def test_threads_of_a_node_with_many_subscriptions(network: Network, how: str) -> None:
    program = network.program(
        f"""
        import os, sys, threading
        from rosz.msgs.std_msgs.msg import Int32
        from rosz.node import Node

        def threads():
            return len(os.listdir("/proc/self/task"))

        def heard(message):
            arrived.release()

        arrived = threading.Semaphore(0)
        node = Node("many")
        node.subscription("first", Int32, heard)
        subscriptions = []
        for line in sys.stdin:
            if line == "declare\\n":
                for number in range({MANY}):
                    topic = f"topic{{number}}"
                    if {how!r} == "any type":
                        subscriptions.append(node.subscription(topic, callback=heard))
                    elif {how!r} == "callback":
                        subscriptions.append(node.subscription(topic, Int32, heard))
                    else:
                        subscriptions.append(node.subscription(topic, Int32))
            elif line == "take\\n":
                for subscription in subscriptions:
                    for _ in range(3):
                        if {how!r} == "no callback":
                            subscription.get({TIMEOUT})
                        else:
                            arrived.acquire()
                print("all")
            else:
                print("threads", threads())
        """
    )
    counts = 0

    def threads() -> int:
        nonlocal counts
        counts += 1
        program.say("count")
        return int(program.wait_for("threads", times=counts).split()[1])

    talker = network.node("talker")
    few = threads()
    program.say("declare")
    publishers = [talker.publisher(f"topic{number}", Int32) for number in range(MANY)]
    for publisher in publishers:
        publisher.wait_for_subscribers(timeout=TIMEOUT)
    eventually(lambda: threads() <= few + MORE_THREADS, "few threads without traffic")
    for number in range(3):
        for publisher in publishers:
            publisher.publish(number)
    program.say("take")
    program.wait_for("all")
    eventually(lambda: threads() <= few + MORE_THREADS, "few threads after the traffic")


def test_a_subscription_without_traffic_keeps_no_thread(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[worker.Serial] = []

    class Recorded(worker.Serial):
        def __init__(self, *args: Any, **options: Any) -> None:
            super().__init__(*args, **options)
            made.append(self)

    monkeypatch.setattr(worker, "_LENT_SECONDS", 2 * TIMEOUT)
    monkeypatch.setattr(declared, "Serial", Recorded)
    network.node("idle").subscription("topic", Int32, lambda _: None)
    assert made
    eventually(lambda: not any(serial._working.locked() for serial in made), "all at rest")


def test_messages_of_each_of_many_topics_come_in_order(talker: Node, listener: Node) -> None:
    """Also while subscriptions become busy, and while more are busy than may be."""
    topics, count = 30, 300
    got: list[list[int]] = [[] for _ in range(topics)]
    complete = threading.Semaphore(0)

    def heard(topic: int, message: Int32, info: MessageInfo) -> None:
        assert info.lost == 0
        got[topic].append(message.data)
        if len(got[topic]) == count:
            complete.release()

    publishers = []
    for topic in range(topics):

        def callback(message: Int32, info: MessageInfo, topic: int = topic) -> None:
            heard(topic, message, info)

        listener.subscription(f"topic{topic}", Int32, callback, queue_size=count, with_info=True)
        publishers.append(talker.publisher(f"topic{topic}", Int32))
    for publisher in publishers:
        publisher.wait_for_subscribers()
    for number in range(count):
        for publisher in publishers:
            publisher.publish(number)
    assert all(complete.acquire(timeout=TIMEOUT) for _ in range(topics))
    assert got == [list(range(count))] * topics


def test_a_callback_may_wait_for_that_of_another_subscription(talker: Node, listener: Node) -> None:
    second = threading.Event()
    done = threading.Event()

    def wait(_: Empty) -> None:
        assert second.wait(TIMEOUT)
        done.set()

    listener.subscription("first", Empty, wait)
    listener.subscription("second", Empty, lambda _: second.set())
    publishers = [talker.publisher(topic, Empty) for topic in ("first", "second")]
    for publisher in publishers:
        publisher.wait_for_subscribers()
        publisher.publish()
    assert done.wait(TIMEOUT)


def test_many_callbacks_that_block_hold_up_no_other(talker: Node, listener: Node) -> None:
    count = 200
    inside: SimpleQueue[int] = SimpleQueue()
    go_on, reached = threading.Event(), threading.Event()

    def block(message: Int32) -> None:
        inside.put(message.data)
        assert go_on.wait(TIMEOUT)

    for number in range(count):
        listener.subscription(f"topic{number}", Int32, block)
    listener.subscription("other", Empty, lambda _: reached.set())
    publishers = [talker.publisher(f"topic{number}", Int32) for number in range(count)]
    other = talker.publisher("other", Empty)
    for publisher in publishers:
        publisher.wait_for_subscribers()
    other.wait_for_subscribers()
    for number, publisher in enumerate(publishers):
        publisher.publish(number)
    assert {inside.get(timeout=TIMEOUT) for _ in range(count)} == set(range(count))
    other.publish()
    assert reached.wait(TIMEOUT)
    go_on.set()


def test_a_busy_subscription_closes_in_its_own_callback(talker: Node, listener: Node) -> None:
    closed = threading.Event()

    def callback(message: Int32) -> None:
        if message.data == 500:
            subscription.close()
            closed.set()

    subscription = listener.subscription("count", Int32, callback, queue_size=1000)
    publisher = talker.publisher("count", Int32)
    publisher.wait_for_subscribers()
    for number in range(1000):
        publisher.publish(number)
    assert closed.wait(TIMEOUT)
    eventually(lambda: not publisher.subscribers(), "its end")
