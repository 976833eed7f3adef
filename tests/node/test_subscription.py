from __future__ import annotations

import asyncio
import threading
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ClosedError, WaitTimeout
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.std_msgs.msg import Header, Int32, String
from rosz.node import MessageInfo, Node, Publisher
from rosz.qos import LATCHED, QoS
from rosz.session import Reply


def meet(talker: Node, listener: Node) -> None:
    """Wait until the talker knows what the listener has declared so far."""
    listener.subscription("meet", String)
    talker.publisher("meet", String).wait_for_subscribers()


def chatter(talker: Node, **options: Any) -> Publisher[String]:
    return talker.publisher("chatter", String, **options)


def connected(talker: Node) -> Publisher[String]:
    """Return a publisher that has a subscription."""
    publisher = chatter(talker)
    publisher.wait_for_subscribers()
    return publisher


def test_callback(talker: Node, listener: Node) -> None:
    got: SimpleQueue[String] = SimpleQueue()
    listener.subscription("chatter", String, got.put)
    publisher = connected(talker)
    for text in ("one", "two"):
        publisher.publish(text)
    assert [got.get(timeout=TIMEOUT).data for _ in range(2)] == ["one", "two"]


def test_callbacks_come_one_at_a_time_in_order(talker: Node, listener: Node) -> None:
    inside = threading.Lock()
    got: list[int] = []
    done = threading.Event()

    def callback(message: Int32) -> None:
        assert inside.acquire(blocking=False)
        got.append(message.data)
        inside.release()
        if message.data == 199:
            done.set()

    listener.subscription("count", Int32, callback, queue_size=1000)
    publisher = talker.publisher("count", Int32)
    publisher.wait_for_subscribers()
    for number in range(200):
        publisher.publish(number)
    assert done.wait(TIMEOUT)
    assert got == list(range(200))


@pytest.mark.parametrize("with_callback", [True, False])
def test_newest_samples_are_kept(talker: Node, listener: Node, with_callback: bool) -> None:
    """Behind a slow callback, or without a reader, the ``queue_size`` newest samples wait."""
    got: SimpleQueue[int] = SimpleQueue()
    gate = threading.Event()

    def slow(message: Int32) -> None:
        got.put(message.data)
        assert gate.wait(TIMEOUT)

    publisher = talker.publisher("count", Int32)
    after = listener.subscription("after", String)
    subscription = listener.subscription(
        "count", Int32, slow if with_callback else None, queue_size=3
    )
    publisher.wait_for_subscribers()
    publisher.publish(0)
    if with_callback:
        assert got.get(timeout=TIMEOUT) == 0
    for number in range(1, 20):
        publisher.publish(number)
    talker.publisher("after", String).publish("all that")
    after.get()
    gate.set()
    if with_callback:
        assert [got.get(timeout=TIMEOUT) for _ in range(3)] == [17, 18, 19]
    else:
        waiting = subscription._queue.items  # each subscription has a thread that fills its own
        eventually(
            lambda: waiting and Int32._decode(waiting[-1][0].payload).data == 19, "the last one"
        )
        assert [subscription.get().data for _ in range(3)] == [17, 18, 19]


def test_what_is_pushed_out_is_not_decoded(
    talker: Node, listener: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded: list[bytes] = []
    decode = Int32._decode

    def counted(data: bytes) -> Int32:
        decoded.append(data)
        return decode(data)

    monkeypatch.setattr(Int32, "_decode", counted)
    subscription = listener.subscription("count", Int32, queue_size=1)
    publisher = talker.publisher("count", Int32)
    publisher.wait_for_subscribers()
    for number in range(50):
        publisher.publish(number)
    last, waiting = Int32._encode(Int32(49)), subscription._queue.items
    eventually(lambda: waiting and waiting[-1][0].payload == last, "the last one")
    assert subscription.get().data == 49
    assert len(decoded) == 1


def test_info(talker: Node, listener: Node) -> None:
    got: SimpleQueue[tuple[String, MessageInfo]] = SimpleQueue()
    listener.subscription("chatter", String, lambda *both: got.put(both), with_info=True)
    publisher = connected(talker)
    for count in (1, 2):
        publisher.publish("hello")
        message, info = got.get(timeout=TIMEOUT)
        assert message == String("hello")
        assert info.sequence == count
        assert info.gid == publisher.gid
        assert 0 < info.source_time <= info.reception_time
        assert info.lost == 0
        assert info.type_name == "std_msgs/msg/String"


def test_gaps_are_counted_per_publisher(talker: Node, listener: Node) -> None:
    """What newer samples pushed out is a gap before them; another publisher has its own count."""
    after = listener.subscription("after", String)
    got: SimpleQueue[tuple[str, int]] = SimpleQueue()
    gate = threading.Event()

    def callback(message: String, info: MessageInfo) -> None:
        got.put((message.data, info.lost))
        assert gate.wait(TIMEOUT)

    listener.subscription("chatter", String, callback, queue_size=2, with_info=True)
    one, other = chatter(talker), chatter(talker)
    one.wait_for_subscribers()
    one.publish("1")
    assert got.get(timeout=TIMEOUT) == ("1", 0)
    for number in range(2, 8):
        one.publish(str(number))
    other.publish("other")
    talker.publisher("after", String).publish("all that")
    after.get()
    gate.set()
    assert [got.get(timeout=TIMEOUT) for _ in range(2)] == [("7", 5), ("other", 0)]


def test_header_gets_the_sequence_number(talker: Node, listener: Node) -> None:
    subscription = listener.subscription("camera", Image)
    publisher = talker.publisher("camera", Image)
    publisher.wait_for_subscribers()
    for count in (1, 2):
        publisher.publish(Image(header=Header(frame_id="lens")))
        assert subscription.get().header.seq == count


def test_raw(talker: Node, listener: Node) -> None:
    subscription = listener.subscription("chatter", String, raw=True)
    publisher = connected(talker)
    publisher.publish("hello")
    assert subscription.get() == String("hello").to_cdr()  # type: ignore[comparison-overlap]


def test_get(talker: Node, listener: Node) -> None:
    subscription = listener.subscription("chatter", String)
    with pytest.raises(WaitTimeout, match=r"no message on '/chatter' within 0\.01 s"):
        subscription.get(0.01)
    publisher = connected(talker)
    publisher.publish("hello")
    assert subscription.get() == String("hello")


def test_several_may_wait(network: Network, talker: Node, listener: Node) -> None:
    """Each message wakes one of them, and the end wakes them all."""
    subscription = listener.subscription("chatter", String)
    got: SimpleQueue[str] = SimpleQueue()

    def take() -> None:
        for message in subscription:
            got.put(message.data)

    waiting = [network.thread(take) for _ in range(4)]
    publisher = connected(talker)
    for number in range(10):
        publisher.publish(str(number))
    assert sorted(got.get(timeout=TIMEOUT) for _ in range(10)) == [str(n) for n in range(10)]
    subscription.close()
    for thread in waiting:
        thread.join(TIMEOUT)
        assert not thread.is_alive()


def test_closing_ends_a_wait(network: Network, listener: Node) -> None:
    subscription = listener.subscription("chatter", String)
    ends: SimpleQueue[object] = SimpleQueue()

    def take() -> None:
        try:
            subscription.get(TIMEOUT)
        except ClosedError as error:
            ends.put(str(error))

    network.thread(take)
    listener.close()
    assert (
        ends.get(timeout=TIMEOUT)
        == "cannot get a message: the subscription of '/chatter' is closed"
    )


def test_async_iteration(talker: Node, listener: Node) -> None:
    subscription = listener.subscription("chatter", String)
    publisher = connected(talker)

    async def collect() -> list[str]:
        found = []
        publisher.publish("0")
        async for message in subscription:
            found.append(message.data)
            if len(found) == 3:
                break
            await asyncio.to_thread(publisher.publish, str(len(found)))
        return found

    assert asyncio.run(collect()) == ["0", "1", "2"]


def test_async_iteration_ends_with_the_node(listener: Node) -> None:
    subscription = listener.subscription("chatter", String)

    async def collect() -> list[String]:
        closing = asyncio.create_task(asyncio.to_thread(listener.close))
        found = [message async for message in subscription]
        await closing
        return found

    assert asyncio.run(asyncio.wait_for(collect(), TIMEOUT)) == []


def test_two_loops_and_a_sample_after_them(talker: Node, listener: Node) -> None:
    """A loop that ended while a sample was on its way does no harm."""
    subscription = listener.subscription("chatter", String)
    publisher = connected(talker)

    async def first() -> str:
        publisher.publish("hello")
        async for message in subscription:
            return message.data
        raise AssertionError

    assert asyncio.run(first()) == "hello"
    assert asyncio.run(first()) == "hello"
    publisher.publish("afterwards")
    assert subscription.get().data == "afterwards"


def test_exception_in_callback(
    talker: Node, listener: Node, capfd: pytest.CaptureFixture[str]
) -> None:
    got: SimpleQueue[str] = SimpleQueue()

    def callback(message: String) -> None:
        got.put(message.data)
        if message.data == "exit":
            raise SystemExit(3)
        if message.data == "stop":
            raise GeneratorExit
        if message.data != "end":
            raise ValueError(f"cannot stand '{message.data}'")

    listener.subscription("chatter", String, callback)
    publisher = connected(talker)
    for text in ("one", "exit", "stop", "two", "end"):
        publisher.publish(text)
        assert got.get(timeout=TIMEOUT) == text
    listener.close()
    errors = capfd.readouterr().err
    assert errors.count("callback of '/chatter' failed") == 4
    assert "ValueError: cannot stand 'one'" in errors


def test_closed_in_its_own_callback(talker: Node, listener: Node) -> None:
    closed = threading.Event()

    def callback(_message: String) -> None:
        subscription.close()
        closed.set()

    subscription = listener.subscription("chatter", String, callback)
    publisher = connected(talker)
    publisher.publish("hello")
    assert closed.wait(TIMEOUT)
    eventually(lambda: not publisher.subscribers(), "the subscription is gone from the graph")


def test_publishers(network: Network, talker: Node, listener: Node) -> None:
    subscription = listener.subscription("chatter", String)
    chatter(talker)
    network.node("other").publisher("chatter", Int32)
    graph = listener.context.graph
    graph.wait_for(lambda view: len(view.publishers("/chatter")) == 2, TIMEOUT, "publishers")
    eventually(subscription.publishers, "the subscription knows, too")
    assert [token.node_name for token in subscription.publishers()] == ["/talker"]


def test_hears_itself(talker: Node) -> None:
    subscription = talker.subscription("chatter", String)
    chatter(talker).publish("hello")
    assert subscription.get() == String("hello")


class TestLatched:
    def test_late_joiners_get_the_last_message(self, network: Network, talker: Node) -> None:
        publisher = chatter(talker, latch=True)
        publisher.publish("old")
        publisher.publish("new")
        for number in (1, 2):
            subscription = network.node(f"listener{number}").subscription("chatter", String)
            assert subscription.get().data == "new"

    def test_of_several_publishers(self, network: Network, talker: Node, listener: Node) -> None:
        """In one process or several, each one's last message arrives."""
        texts = {"one", "two", "three"}
        nodes = (talker, talker, network.node("another"))
        for text, node in zip(sorted(texts), nodes, strict=True):
            chatter(node, latch=True).publish(text)
        subscription = listener.subscription("chatter", String)
        assert {subscription.get().data for _ in texts} == texts

    def test_each_message_comes_once(self, talker: Node, listener: Node) -> None:
        """What arrives live is not taken from the cache again."""
        publisher = chatter(talker, latch=True)
        subscription = listener.subscription("chatter", String)
        publisher.wait_for_subscribers()
        publisher.publish("first")
        assert subscription.get().data == "first"  # what was in the cache has been asked for
        for text in ("one", "two"):
            publisher.publish(text)
        assert subscription.get().data == "one"
        assert subscription.get().data == "two"
        with pytest.raises(WaitTimeout):
            subscription.get(0.2)

    def test_with_a_callback(self, network: Network, talker: Node) -> None:
        publisher = chatter(talker, latch=True)
        publisher.publish("old")
        got: SimpleQueue[str] = SimpleQueue()
        network.node("listener").subscription("chatter", String, lambda m: got.put(m.data))
        assert got.get(timeout=TIMEOUT) == "old"
        publisher.publish("new")
        assert got.get(timeout=TIMEOUT) == "new"

    def test_waits_for_the_callback_of_what_came_before(
        self, network: Network, talker: Node, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        publisher = chatter(talker, latch=True)
        entered, go_on = threading.Event(), threading.Event()
        got: SimpleQueue[str] = SimpleQueue()

        def callback(message: String) -> None:
            entered.set()
            assert go_on.wait(TIMEOUT)
            got.put(message.data)
            raise ValueError  # so that `report` is called, where another thread may go on

        listener = network.node("listener")
        monkeypatch.setattr(listener.log, "report", lambda *_: threading.Event().wait(0.01))
        subscription = listener.subscription("chatter", String, callback)
        publisher.wait_for_subscribers()
        eventually(subscription.publishers)
        for number in range(5):
            publisher.publish(str(number))
        assert entered.wait(TIMEOUT)
        replayed = threading.Event()

        def receive(reply: Reply) -> None:
            subscription._receive(reply, subscription._decoder)
            replayed.set()

        (token,) = subscription.publishers()
        subscription._request_history(token, 1, receive)
        assert replayed.wait(TIMEOUT)
        go_on.set()
        assert [got.get(timeout=TIMEOUT) for _ in range(5)] == ["0", "1", "2", "3", "4"]
        assert got.empty()

    def test_transient_local_reader(self, network: Network, talker: Node) -> None:
        """The reader of ROS 2, which recovers history by itself."""
        qos = QoS(depth=3, durability="transient_local")
        publisher = chatter(talker, qos=qos)
        for number in range(5):
            publisher.publish(str(number))
        subscription = network.node("listener").subscription("chatter", String, qos=qos)
        assert [subscription.get().data for _ in range(3)] == ["2", "3", "4"]
        publisher.publish("live")
        assert subscription.get().data == "live"

    @pytest.mark.parametrize("kind", [String, None], ids=["typed", "generic"])
    def test_volatile_reader(
        self, network: Network, talker: Node, kind: type[String] | None
    ) -> None:
        """As in ROS 2: what a publisher has kept is for those that ask for it."""
        publisher = chatter(talker, qos=QoS(depth=3, durability="transient_local"))
        publisher.publish("kept")
        listener = network.node("listener")
        subscription = listener.subscription("chatter", kind, qos=QoS(durability="volatile"))
        publisher.wait_for_subscribers()
        with pytest.raises(WaitTimeout):
            subscription.get(0.3)
        publisher.publish("live")
        assert subscription.get().data == "live"

    def test_publisher_that_comes_later(self, talker: Node, listener: Node) -> None:
        subscription = listener.subscription("chatter", String, qos=LATCHED)
        chatter(talker, latch=True).publish("hello")
        assert subscription.get().data == "hello"

    def test_dead_publishers_are_silent(self, network: Network, talker: Node) -> None:
        """A latched message dies with its publisher, as in ROS 1."""
        publisher = chatter(talker, latch=True)
        publisher.publish("hello")
        publisher.close()
        subscription = network.node("listener").subscription("chatter", String)
        with pytest.raises(WaitTimeout):
            subscription.get(0.2)


class TestGeneric:
    def test_learns_the_type(self, talker: Node, listener: Node) -> None:
        subscription = listener.subscription("chatter")
        meet(talker, listener)
        publisher = chatter(talker)
        publisher.publish("at once")
        assert subscription.get().data == "at once"
        assert subscription.types == ["std_msgs/msg/String"]
        publisher.wait_for_subscribers()
        assert [token.node_name for token in publisher.subscribers()] == ["/listener"]

    def test_latched(self, network: Network, talker: Node) -> None:
        chatter(talker, latch=True).publish("hello")
        got: SimpleQueue[Any] = SimpleQueue()
        network.node("listener").subscription("chatter", callback=got.put)
        assert got.get(timeout=TIMEOUT).data == "hello"

    def test_raw(self, talker: Node, listener: Node) -> None:
        """The form of rospy's AnyMsg: bytes, and the name of their type beside them."""
        got: SimpleQueue[tuple[bytes, MessageInfo]] = SimpleQueue()
        listener.subscription("count", None, lambda *both: got.put(both), raw=True, with_info=True)
        meet(talker, listener)
        talker.publisher("count", Int32).publish(7)
        payload, info = got.get(timeout=TIMEOUT)
        assert payload == Int32(7).to_cdr()
        assert info.type_name == "std_msgs/msg/Int32"

    def test_several_types_on_one_topic(self, talker: Node, listener: Node) -> None:
        subscription = listener.subscription("mixed", queue_size=20)
        meet(talker, listener)
        talker.publisher("mixed", Int32).publish(7)
        talker.publisher("mixed", String).publish("seven")
        assert {type(subscription.get()) for _ in range(2)} == {Int32, String}

    def test_only_its_topic(self, talker: Node, listener: Node) -> None:
        subscription = listener.subscription("chatter")
        meet(talker, listener)
        talker.publisher("chatter/below", String).publish("no")
        talker.publisher("chatter", String).publish("yes")
        assert subscription.get().data == "yes"

    def test_message_for_it_alone(self, talker: Node, listener: Node) -> None:
        publisher = chatter(talker)
        publisher.on_connection(lambda link: link.publish(String(f"welcome {link.node}")))
        assert listener.subscription("chatter").get().data == "welcome /listener"

    def test_unknown_type(
        self, talker: Node, listener: Node, capfd: pytest.CaptureFixture[str]
    ) -> None:
        class Strange(String):
            _type_name = "strange_msgs/msg/Strange"
            _type_hash = "RIHS01_" + "0" * 64

        subscription = listener.subscription("chatter")
        raw = listener.subscription("chatter", raw=True)
        meet(talker, listener)
        publisher = talker.publisher("chatter", Strange)
        for _ in range(3):
            publisher.publish(Strange("hello"))
            assert raw.get() == String("hello").to_cdr()
        eventually(lambda: len(subscription._queue.items) == 3, "the same for the other one")
        with pytest.raises(WaitTimeout):
            subscription.get(0.01)
        listener.close()
        errors = capfd.readouterr().err
        assert errors.count("cannot decode what comes on '/chatter'") == 1
        assert "strange_msgs/msg/Strange" in errors

    def test_ends_with_its_node(self, network: Network, talker: Node, listener: Node) -> None:
        publisher = chatter(talker)
        subscription = listener.subscription("chatter")
        publisher.wait_for_subscribers()
        ended = network.thread(lambda: list(subscription))
        listener.close()
        ended.join(TIMEOUT)
        assert not ended.is_alive()
        assert subscription.closed
        eventually(lambda: not publisher.subscribers(), "the subscription is gone from the graph")
