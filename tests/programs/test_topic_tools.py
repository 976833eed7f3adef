"""topic_tools: relay, throttle, drop, mux, demux, transform."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from types import SimpleNamespace
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually
from ros1.programs.runners import Ros

from rosz.msgs.std_msgs.msg import String
from rosz.msgs.topic_tools.srv import DemuxSelect, MuxSelect
from rosz.node import Node
from rosz.programs.topic_tools.expression import _evaluate
from rosz.programs.topic_tools.mux import Demux, Mux
from rosz.programs.topic_tools.relay import ByteLimit, PeriodLimit, RelayedTopic, Share

from .sides import RealSide, RoszSide, run_script

SECOND = 1_000_000_000


class Clock:
    """A clock that stands still."""

    def __init__(self) -> None:
        self.now = 100 * SECOND

    def __call__(self) -> int:
        return self.now


def accepted(accept: Any, clock: Clock, seconds: float, count: int, size: int = 15) -> list[int]:
    """Return which of some messages are accepted that come each some seconds."""
    found = []
    for number in range(count):
        if accept(bytes(size)):
            found.append(number)
        clock.now += int(seconds * SECOND)
    return found


def test_a_period_lies_between_messages() -> None:
    clock = Clock()
    assert accepted(PeriodLimit(2, clock), clock, 0.2, 10) == [0, 3, 6, 9]


def test_a_clock_that_is_set_back_begins_a_new_period() -> None:
    clock = Clock()
    limit = PeriodLimit(1, clock)
    assert limit(b"")
    clock.now -= 50 * SECOND
    assert not limit(b"")
    clock.now += 2 * SECOND
    assert limit(b"")


def test_bytes_within_a_window() -> None:
    clock = Clock()
    # 11 bytes each, as the header of four does not count: ten of them reach 110.
    assert accepted(ByteLimit(110, 1, clock), clock, 0.05, 25) == [*range(10), *range(21, 25)]


def test_a_share_of_messages() -> None:
    clock = Clock()
    assert accepted(Share(1, 3), clock, 0, 7) == [1, 2, 4, 5]
    assert accepted(Share(0, 1), clock, 0, 3) == [0, 1, 2]
    assert accepted(Share(3, 2), clock, 0, 4) == []


class Heard:
    """What comes on a topic."""

    def __init__(self, node: Node, topic: str) -> None:
        self.texts: SimpleQueue[str] = SimpleQueue()
        self.part = node.subscription(topic, String, lambda message: self.texts.put(message.data))

    def next(self) -> str:
        return self.texts.get(timeout=TIMEOUT)


def subscribers(node: Node, topic: str) -> list[str]:
    view = node.context.graph.view()
    return [token.node_name for token in view.subscriptions(topic)]


def await_subscribers(node: Node, topic: str, *names: str) -> None:
    eventually(lambda: subscribers(node, topic) == list(names), f"{names} subscribe to {topic}")


def test_a_relay_passes_on_a_type_that_it_has_no_definition_of(network: Network) -> None:
    folder = network.folder / "src" / "secret_msgs"
    (folder / "msg").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>secret_msgs</name></package>")
    (folder / "msg" / "Code.msg").write_text("string text\nint32 number\n")
    user = network.node("user", context=network.context(package_roots=(network.folder / "src",)))
    RelayedTopic(network.node("relay"), "/in", "/out")
    code = user.context.types.message("secret_msgs/Code")
    heard: SimpleQueue[Any] = SimpleQueue()
    user.subscription("/out", code, heard.put)
    publisher = user.publisher("/in", code)
    publisher.wait_for_subscribers()
    publisher.publish("open", 7)
    message = heard.get(timeout=TIMEOUT)
    assert (message.text, message.number) == ("open", 7)


def test_a_relay_of_a_latched_topic_latches(network: Network) -> None:
    user, relay = network.node("user"), network.node("relay")
    user.publisher("/in", String, latch=True).publish("kept")
    RelayedTopic(relay, "/in", "/out")
    assert Heard(user, "/out").next() == "kept"
    assert Heard(network.node("late"), "/out").next() == "kept"


def test_a_lazy_relay_subscribes_while_it_has_subscribers(network: Network) -> None:
    user, relay = network.node("user"), network.node("relay")
    relay.params.set("~lazy", True)
    RelayedTopic(relay, "/in", "/out")
    publisher = user.publisher("/in", String)
    publisher.wait_for_subscribers()
    publisher.publish("first")  # with which the output is announced
    await_subscribers(user, "/in")
    heard = Heard(user, "/out")
    await_subscribers(user, "/in", "/relay")
    publisher.publish("second")
    assert heard.next() == "second"
    heard.part.close()
    await_subscribers(user, "/in")


def test_a_stealthy_relay_hears_only_with_others(network: Network) -> None:
    user, relay = network.node("user"), network.node("relay")
    relay.params.set("~stealth", True)
    relay.params.set("~monitor_rate", 0.01)
    RelayedTopic(relay, "/in", "/out")
    publisher = user.publisher("/in", String)
    publisher.wait_for_subscribers()
    heard = Heard(user, "/out")
    await_subscribers(relay, "/out", "/user")  # the relay stops listening without any
    followed = relay.context.graph._whole
    assert followed is not None
    # Until then, the output that the first message announces does not know of its subscribers.
    eventually(lambda: followed.complete, "all that the relay's graph looks for")
    publisher.publish("first")
    assert heard.next() == "first"
    await_subscribers(user, "/in")
    other = Heard(user, "/in")
    await_subscribers(user, "/in", "/relay", "/user")
    publisher.publish("second")
    assert heard.next() == other.next() == "second"
    other.part.close()
    await_subscribers(user, "/in")


def test_a_relay_of_a_topic_to_itself_is_refused(network: Network) -> None:
    with pytest.raises(SystemExit, match="the input and the output are both '/in'"):
        RelayedTopic(network.node("relay"), "in", "/in")


def test_a_lazy_mux_subscribes_to_what_is_selected(network: Network) -> None:
    user, mux = network.node("user"), network.node("mux")
    mux.params.set("~lazy", True)
    Mux(mux, "/out", ["/a", "/b"])
    select = user.client("/mux/select", MuxSelect)
    select.wait_for_service(TIMEOUT)
    publisher, _ = user.publisher("/a", String), user.publisher("/b", String)
    await_subscribers(user, "/b", "/mux")
    publisher.wait_for_subscribers()
    publisher.publish("a")
    await_subscribers(user, "/a")
    await_subscribers(user, "/b")
    Heard(user, "/out")
    await_subscribers(user, "/a", "/mux")
    assert select("/b").prev_topic == "/a"
    await_subscribers(user, "/a")
    await_subscribers(user, "/b", "/mux")


def test_a_demux_sends_to_what_is_selected(network: Network) -> None:
    user, demux = network.node("user"), network.node("demux")
    Demux(demux, "/in", ["/a", "/b"])
    first, second = Heard(user, "/a"), Heard(user, "/b")
    publisher = user.publisher("/in", String)
    publisher.wait_for_subscribers()
    publisher.publish("one")
    assert first.next() == "one"
    select = user.client("/demux/select", DemuxSelect)
    select.wait_for_service(TIMEOUT)
    assert select("/b").prev_topic == "/a"
    publisher.publish("two")
    assert second.next() == "two"
    assert first.texts.empty()


USER = """
import rospy
from std_msgs.msg import Float32, String
from topic_tools.srv import MuxAdd, MuxDelete, MuxList, MuxSelect

rospy.init_node("user")

def tried(function, *arguments):
    try:
        return function(*arguments)
    except rospy.ServiceException:
        return "refused"

calls = {}
for name, kind in dict(add=MuxAdd, delete=MuxDelete, list=MuxList, select=MuxSelect).items():
    rospy.wait_for_service("mux/" + name)
    calls[name] = rospy.ServiceProxy("mux/" + name, kind)

selected = []
rospy.Subscriber("mux/selected", String, lambda message: selected.append(message.data))
while not selected:
    rospy.sleep(0.01)

def topics():
    return list(calls["list"]().topics)

print("topics", topics())
print("select b", calls["select"]("b").prev_topic)
print("select nothing known", tried(calls["select"], "c"))
print("add c", tried(calls["add"], "c") and topics())
print("add c again", tried(calls["add"], "/c"), topics())
print("add none", tried(calls["add"], "__none"))
print("delete b", tried(calls["delete"], "b"), topics())
print("delete d", tried(calls["delete"], "d"))
print("select none", calls["select"]("__none").prev_topic)
print("select a", repr(calls["select"]("/a").prev_topic))
print("delete b", tried(calls["delete"], "b") and topics())
while len(selected) < 4:
    rospy.sleep(0.01)
print("selected", selected)

def passed(source, target, count, of=1, get=1):
    # No queue overflows, however busy the machine is: of so many, so many must have come first.
    heard = []
    rospy.Subscriber(target, String, lambda message: heard.append(message.data), queue_size=100)
    publisher = rospy.Publisher(source, String, queue_size=100)
    while not heard:
        publisher.publish("wake")
        rospy.sleep(0.02)
    for number in range(count):
        publisher.publish(str(number))
        while sum(map(str.isdigit, heard)) < (number + 1) // of * get:
            rospy.sleep(0.005)
    publisher.publish("end")
    publisher.publish("end")
    publisher.publish("end")
    while "end" not in heard:
        rospy.sleep(0.02)
    return [text for text in heard if text.isdigit()]

print("relayed", passed("n", "n_relay", 9))
print("named", passed("n", "named", 9))
print("muxed", passed("a", "out", 9))
print("dropped", len(passed("n", "n_drop", 30, 3, 2)))

heard = []
rospy.Subscriber("tripled", Float32, lambda message: heard.append(message.data))
publisher = rospy.Publisher("number", Float32, queue_size=1)
while not heard:
    publisher.publish(2.5)
    rospy.sleep(0.02)
print("transformed", heard[0])
rospy.signal_shutdown("done")
"""
COMMANDS = (
    ("topic_tools", "mux", "out", "a", "b"),
    ("topic_tools", "relay", "n"),
    ("topic_tools", "relay", "n", "named"),
    ("topic_tools", "drop", "n", "1", "3"),
    (
        *("topic_tools", "transform", "number", "tripled", "std_msgs/Float32"),
        *("m.data * 3.0", "--wait-for-start"),
    ),
)


def test_the_programs_do_what_those_of_ros_1_do(ros: Ros, network: Network, tmp_path: Path) -> None:
    if not Path("/usr/lib/topic_tools/mux").exists():
        pytest.skip("needs topic_tools of ROS 1 (Debian: topic-tools, python3-topic-tools)")
    with ThreadPoolExecutor(2) as pool:
        expected = pool.submit(run_script, RealSide(ros), tmp_path, USER, *COMMANDS)
        found = pool.submit(run_script, RoszSide(network), tmp_path, USER, *COMMANDS)
    assert found.result() == expected.result()


def test_names_of_builtin_functions_are_texts() -> None:
    fields = {"frame_id": "map", "child_frame_id": "object", "width": "m.height + max(1, 2)"}
    point = SimpleNamespace(height=3)
    assert _evaluate(fields, point) == fields | {"width": 5}


def test_calls_of_a_mux(network: Network) -> None:
    Mux(network.node("mux"), "/out", ["/a", "/b"])
    add = network.run("-m", "rosz", "run", "topic_tools", "mux_add", "mux", "/c")
    add.wait_for('Adding "/c" to mux "mux"')
    assert add.exit_code() == 0
    listing = network.run("-m", "rosz", "run", "topic_tools", "mux_list", "mux")
    listing.wait_for("['/a', '/b', '/c']")
    assert listing.exit_code() == 0
    wrong = network.run("-m", "rosz", "run", "topic_tools", "mux_select", "mux", "/d")
    wrong.wait_for("mux: it has no topic '/d'; it has /a, /b, /c")
    assert wrong.exit_code() == 1
