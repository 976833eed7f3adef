from __future__ import annotations

import signal
import threading
import time
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ClosedError, EncodeError, InvalidName, UsageError, WaitTimeout
from rosz.lifecycle import Registration
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.std_msgs.msg import Int32, String, UInt8MultiArray
from rosz.msgs.std_srvs.srv import Empty, Trigger
from rosz.node import Node, SubscriberLink
from rosz.qos import QoS


@pytest.mark.parametrize(
    ("args", "fields"),
    [
        ((Vector3(1.0, 2.0, 3.0),), {}),
        ((1.0, 2.0, 3.0), {}),
        ((1.0,), {"y": 2.0, "z": 3.0}),
        ((), {"x": 1.0, "y": 2.0, "z": 3.0}),
    ],
)
def test_ways_to_publish(talker: Node, args: tuple[Any, ...], fields: dict[str, Any]) -> None:
    subscription = talker.subscription("point", Vector3)
    talker.publisher("point", Vector3).publish(*args, **fields)
    assert subscription.get() == Vector3(1.0, 2.0, 3.0)


def test_class_of_the_same_type_from_elsewhere(talker: Node) -> None:
    """Two classes of one definition, such as a compiled and a shipped one, are the same type."""

    class Other(String):
        pass

    subscription = talker.subscription("chatter", Other)
    talker.publisher("chatter", Other).publish(String("hello"))
    assert subscription.get().data == "hello"


@pytest.mark.parametrize(
    ("args", "fields", "text"),
    [
        ((Twist(),), {}, r"std_msgs/Int32\.data: .*Twist"),
        ((1, 2), {}, "std_msgs/Int32: .*got int, int"),
        ((), {"dat": 1}, "std_msgs/Int32: .*'dat'"),
        (("one",), {}, r"std_msgs/Int32\.data: .*'one'"),
        ((1 << 31,), {}, r"std_msgs/Int32\.data: .*2147483648"),
    ],
)
def test_what_does_not_fit(
    talker: Node, args: tuple[Any, ...], fields: dict[str, Any], text: str
) -> None:
    publisher = talker.publisher("count", Int32)
    with pytest.raises(EncodeError, match=text):
        publisher.publish(*args, **fields)


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_any_bytes_may_be_sent_raw(talker: Node, listener: Node, kind: Any) -> None:
    subscription = listener.subscription("chatter", String)
    publisher = talker.publisher("chatter", String)
    publisher.wait_for_subscribers()
    publisher.publish_raw(kind(String("hello").to_cdr()))
    assert subscription.get().data == "hello"


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        ("text", "std_msgs/String: expected bytes, got str"),
        (None, "std_msgs/String: expected bytes, got NoneType"),
        (b"", "std_msgs/String: expected CDR with its header, got 0 bytes"),
    ],
)
def test_what_cannot_be_sent_raw(talker: Node, payload: Any, reason: str) -> None:
    with pytest.raises(EncodeError, match=reason):
        talker.publisher("chatter", String).publish_raw(payload)


@pytest.mark.parametrize("name", ["/", ""])
def test_the_root_is_no_topic(talker: Node, name: str) -> None:
    for declare in (
        lambda: talker.publisher(name, String),
        lambda: talker.subscription(name, String),
        lambda: talker.subscription(name),
        lambda: talker.client(name, Empty),
    ):
        with pytest.raises(InvalidName, match="'/' is not a valid name: it is the root namespace"):
            declare()


def test_bad_topic(talker: Node) -> None:
    with pytest.raises(InvalidName, match="'1st' is not a valid name"):
        talker.publisher("1st", String)


def test_closed(talker: Node) -> None:
    publisher = talker.publisher("chatter", String)
    publisher.close()
    publisher.close()
    with pytest.raises(ClosedError, match="the publisher is closed"):
        publisher.publish("hello")
    assert repr(publisher) == "<Publisher /chatter [std_msgs/msg/String] closed>"


def test_closed_follows_nobody(talker: Node) -> None:
    interests = talker.context.graph._interests
    publisher = talker.publisher("chatter", String)
    publisher.on_connection(print)
    assert [one for one in interests.all() if one.name == "/chatter"]
    publisher.close()
    with pytest.raises(ClosedError, match="cannot follow its subscriptions"):
        publisher.on_connection(print)
    eventually(
        lambda: not [one for one in interests.all() if one.name == "/chatter"],
        "the end of its watch",
    )


def test_interrupted_while_it_closes(talker: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    publisher = talker.publisher("chatter", String)
    graph = talker.context.graph
    graph.wait_for_topic("/chatter", TIMEOUT)

    def interrupt() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(publisher, "_finish", interrupt)
    with pytest.raises(KeyboardInterrupt):
        publisher.close()
    graph.wait_for(lambda view: not view.publishers("/chatter"), TIMEOUT, "end of '/chatter'")


def test_what_comes_to_a_closed_one_is_closed(talker: Node) -> None:
    publisher = talker.publisher("chatter", String)
    publisher.close()
    withdrawn: list[bool] = []
    with pytest.raises(ClosedError, match="cannot declare anything more"):
        publisher.keep(Registration(lambda: withdrawn.append(True)))
    assert withdrawn == [True]


def test_no_queue_is_less_than_empty(talker: Node) -> None:
    qos = QoS(depth=-1)
    for declare in (
        lambda: talker.publisher("chatter", String, qos=qos),
        lambda: talker.subscription("chatter", String, qos=qos),
        lambda: talker.subscription("chatter", qos=qos),
        lambda: talker.client("call", Trigger, qos=qos),
    ):
        with pytest.raises(UsageError, match="depth is -1: expected 1 or more"):
            declare()


@pytest.mark.parametrize("depth", [0, 1 << 80])
def test_depth_beyond_counting_is_latched_too(talker: Node, listener: Node, depth: int) -> None:
    """0 leaves it to the system."""
    qos = QoS(depth=depth, durability="transient_local")
    talker.publisher("chatter", String, qos=qos).publish("kept")
    assert listener.subscription("chatter", String, qos=qos).get(TIMEOUT).data == "kept"


def test_as_context_manager(talker: Node) -> None:
    with talker.publisher("chatter", String) as publisher:
        assert not publisher.closed
    assert publisher.closed


def test_closing_while_others_publish(network: Network, talker: Node, listener: Node) -> None:
    """Zenoh's handle refuses to be undeclared inside its put: closing has to wait its turn."""
    listener.subscription("chatter", String, lambda _: None)
    for _ in range(20):
        publisher = talker.publisher("chatter", String)
        going = threading.Barrier(5)
        unexpected: list[BaseException] = []

        def work(publisher: Any = publisher, going: Any = going, bad: Any = unexpected) -> None:
            going.wait(TIMEOUT)
            try:
                while True:
                    publisher.publish("hello")
            except ClosedError:
                return
            except BaseException as error:  # noqa: BLE001  # whatever it is, it is wrong
                bad.append(error)

        threads = [network.thread(work) for _ in range(4)]
        going.wait(TIMEOUT)
        publisher.close()
        for thread in threads:
            thread.join(TIMEOUT)
        assert not unexpected


def test_wait_for_subscribers(network: Network, talker: Node, listener: Node) -> None:
    publisher = talker.publisher("chatter", String)
    listener.subscription("chatter", Int32)
    with pytest.raises(WaitTimeout, match=r"no 1 subscriber\(s\) of '/chatter' with type") as got:
        publisher.wait_for_subscribers(timeout=0.05)
    assert isinstance(got.value, TimeoutError)
    waited = network.thread(lambda: publisher.wait_for_subscribers(2))
    listener.subscription("chatter", String)
    talker.subscription("chatter", String)
    waited.join(TIMEOUT)
    assert [token.node_name for token in publisher.subscribers()] == ["/listener", "/talker"]


def test_wait_ends_with_the_node(network: Network, talker: Node) -> None:
    publisher = talker.publisher("chatter", String)
    ended: SimpleQueue[str] = SimpleQueue()

    def wait() -> None:
        try:
            publisher.wait_for_subscribers(timeout=TIMEOUT)
        except ClosedError as error:
            ended.put(str(error))

    network.thread(wait)
    talker.context.close()
    assert "shutting down" in ended.get(timeout=TIMEOUT)


def test_a_signal_handler_may_publish(network: Network) -> None:
    """It interrupts the main thread anywhere, also while that publishes."""
    heard: SimpleQueue[str] = SimpleQueue()
    network.node("listener").subscription("chatter", String, lambda m: heard.put(m.data))
    program = network.program(
        """
        import signal
        import rosz
        from rosz.msgs.std_msgs.msg import String

        with rosz.Node("talker") as node:
            publisher = node.publisher("chatter", String)
            publisher.wait_for_subscribers()
            calls = 0

            def alarm(*_):
                global calls
                calls += 1
                publisher.publish("alarm")
                signal.setitimer(signal.ITIMER_REAL, 0.0005)  # not periodic: it might nest

            signal.signal(signal.SIGALRM, alarm)
            signal.setitimer(signal.ITIMER_REAL, 0.0005)
            while calls < 300:
                publisher.publish("steady")
            signal.setitimer(signal.ITIMER_REAL, 0)
        print("done")
        """
    )
    program.wait_for("done")
    assert program.exit_code() == 0
    assert heard.get(timeout=TIMEOUT) in {"alarm", "steady"}


class TestConnections:
    def test_come_and_go(self, network: Network, talker: Node, listener: Node) -> None:
        came: SimpleQueue[str] = SimpleQueue()
        went: SimpleQueue[str] = SimpleQueue()
        publisher = talker.publisher("chatter", String)
        early = listener.subscription("chatter", String)
        publisher.wait_for_subscribers()
        publisher.on_connection(lambda link: came.put(link.node), went.put)
        assert came.get(timeout=TIMEOUT) == "/listener"
        network.node("late").subscription("chatter", String)
        assert came.get(timeout=TIMEOUT) == "/late"
        early.close()
        assert went.get(timeout=TIMEOUT) == "/listener"

    def test_first_message_for_one_alone(
        self, network: Network, talker: Node, listener: Node
    ) -> None:
        """rospy's SubscribeListener: each new subscriber gets a message of its own."""
        publisher = talker.publisher("chatter", String)
        first = listener.subscription("chatter", String)
        publisher.on_connection(lambda link: link.publish(String(f"hello {link.node}")))
        assert first.get().data == "hello /listener"
        second = network.node("late").subscription("chatter", String)
        assert second.get().data == "hello /late"
        publisher.publish("to all")
        assert first.get().data == "to all"
        assert second.get().data == "to all"

    def test_two_subscriptions_of_one_node(self, talker: Node, listener: Node) -> None:
        publisher = talker.publisher("chatter", String)
        links: SimpleQueue[SubscriberLink[String]] = SimpleQueue()
        publisher.on_connection(links.put)
        subscriptions = [listener.subscription("chatter", String) for _ in range(2)]
        for number in range(2):
            links.get(timeout=TIMEOUT).publish(String(str(number)))
        assert sorted(each.get().data for each in subscriptions) == ["0", "1"]

    def test_private_messages_make_no_gaps(self, talker: Node, listener: Node) -> None:
        publisher = talker.publisher("chatter", String)
        lost: SimpleQueue[tuple[str, int]] = SimpleQueue()
        listener.subscription(
            "chatter", String, lambda m, info: lost.put((m.data, info.lost)), with_info=True
        )
        links: SimpleQueue[SubscriberLink[String]] = SimpleQueue()
        publisher.on_connection(links.put)
        link = links.get(timeout=TIMEOUT)
        for text in ("1", "2"):
            publisher.publish(text)
            assert lost.get(timeout=TIMEOUT) == (text, 0)
            link.publish(String("psst"))
            assert lost.get(timeout=TIMEOUT) == ("psst", 0)

    @pytest.mark.parametrize("error", [ValueError, SystemExit])
    def test_callback_may_do_anything(
        self, talker: Node, listener: Node, error: type[BaseException]
    ) -> None:
        """The callback may wait for the graph, and may raise: other callbacks go on."""
        seen: SimpleQueue[str] = SimpleQueue()

        def connected(link: SubscriberLink[String]) -> None:
            talker.context.graph.wait_for_node("/listener", TIMEOUT)
            seen.put(link.node)
            raise error("no more")

        publisher = talker.publisher("chatter", String)
        publisher.on_connection(connected)
        for _ in range(2):
            listener.subscription("chatter", String)
            assert seen.get(timeout=TIMEOUT) == "/listener"


STUCK = """
    import rosz, time
    from rosz.msgs.std_msgs.msg import UInt8MultiArray

    node = rosz.Node("stuck")
    node.subscription("data", UInt8MultiArray, lambda m: None)
    print("ready")
    node.spin()
"""


@pytest.mark.parametrize("size", [100, 200_000])
def test_stopped_subscriber_holds_nobody_up(network: Network, size: int) -> None:
    """One that takes nothing delays neither the publisher nor the others."""
    patient = "transport/link/tx/queue/congestion_control/block/wait_before_close=3600000000"
    talker = network.node("talker", context=network.context(zenoh_override=patient))
    listener = network.node("listener")
    publisher = talker.publisher("data", UInt8MultiArray)
    got: SimpleQueue[int] = SimpleQueue()
    listener.subscription("data", UInt8MultiArray, lambda m: got.put(m.data[0]), queue_size=1000)
    stuck = network.program(STUCK)
    publisher.wait_for_subscribers(2)
    stuck.send(signal.SIGSTOP)
    longest = 0.0
    for number in range(60):
        began = time.monotonic()
        publisher.publish(data=bytes([number]) * size)
        longest = max(longest, time.monotonic() - began)
        assert got.get(timeout=TIMEOUT) == number
    stuck.send(signal.SIGCONT)
    assert longest < TIMEOUT  # Zenoh would wait for a link that is full


def test_killed_subscriber_is_gone(network: Network) -> None:
    publisher = network.node("talker").publisher("data", UInt8MultiArray)
    victim = network.program(STUCK)
    publisher.wait_for_subscribers()
    publisher.publish()
    victim.kill()
    # Long before the link would be given up.
    eventually(lambda: not publisher.subscribers(), "the dead subscriber is out of the graph")
    publisher.publish()


def test_blocking_publisher_loses_nothing(talker: Node, listener: Node) -> None:
    """``keep_all`` waits for a slow way rather than drop a sample."""
    qos = QoS(history="keep_all")
    subscription = listener.subscription("data", UInt8MultiArray, qos=qos)
    publisher = talker.publisher("data", UInt8MultiArray, qos=qos)
    publisher.wait_for_subscribers()
    for number in range(200):
        publisher.publish(data=bytes([number]) * 50_000)
    assert [subscription.get().data[0] for _ in range(200)] == list(range(200))
