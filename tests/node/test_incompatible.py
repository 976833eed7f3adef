from __future__ import annotations

from pathlib import Path

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import Int32, String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Node
from rosz.node.incompatible import explain_incompatible
from rosz.wire import NO_HASH, Kind, Token


class Changed(String):
    """A String of another version: same name, another definition."""

    _type_hash = "RIHS01_" + "ab" * 32


@pytest.fixture
def log(network: Network) -> Log:
    return Log(network.folder / "log")


class Log:
    """The log files of all nodes of a test."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @property
    def text(self) -> str:
        return "".join(file.read_text() for file in self._folder.rglob("*.log"))

    def wait_for(self, text: str) -> None:
        eventually(lambda: text in self.text, f"'{text}' in the log")


def see_each_other(one: Node, other: Node) -> None:
    for node, name in ((one, other.name), (other, one.name)):
        node.context.graph.wait_for_node(name, TIMEOUT)


def test_type_is_told_once_on_both_sides(network: Network, log: Log) -> None:
    talker, listener = network.node("talker"), network.node("listener")
    talker.publisher("chatter", String)
    listener.subscription("chatter", Int32)
    on_talker = (
        "node '/listener' subscribes to topic '/chatter' with type 'std_msgs/msg/Int32', but here"
        " it has type 'std_msgs/msg/String': they do not reach each other"
    )
    on_listener = (
        "node '/talker' publishes topic '/chatter' with type 'std_msgs/msg/String', but here it"
        " has type 'std_msgs/msg/Int32': they do not reach each other"
    )
    log.wait_for(on_talker)
    log.wait_for(on_listener)
    again = listener.subscription("chatter", Int32)
    talker.context.graph.wait_for_subscribers("/chatter", 2, TIMEOUT)
    again.close()
    see_each_other(talker, listener)
    assert log.text.count(on_talker) == 1


def test_whoever_comes_second(network: Network, log: Log) -> None:
    """There is a warning about the older entity, too."""
    listener = network.node("listener")
    listener.subscription("chatter", Int32)
    talker = network.node("talker")
    see_each_other(talker, listener)
    talker.publisher("chatter", String)
    log.wait_for("node '/listener' subscribes to topic '/chatter'")
    log.wait_for("node '/talker' publishes topic '/chatter'")


def test_definition(network: Network, log: Log) -> None:
    talker, listener = network.node("talker"), network.node("listener")
    talker.publisher("chatter", String)
    listener.subscription("chatter", Changed)
    log.wait_for(
        "node '/talker' publishes topic '/chatter' with another definition of"
        " 'std_msgs/msg/String' (RIHS01_df668c74…, here RIHS01_abababab…)"
    )


def test_humble_neighbour(network: Network, log: Log) -> None:
    here = network.node("jazzy")
    there = network.node("humble", context=network.context(distro="humble"))
    here.publisher("chatter", String)
    there.subscription("chatter", String)
    log.wait_for(
        "node '/humble' subscribes to topic '/chatter' without a type hash, as ROS 2 Humble does:"
        " they do not reach each other; set ROS_DISTRO=humble here"
    )
    log.wait_for("node '/jazzy' publishes topic '/chatter' with a type hash")


def test_humble_neighbours_understand_each_other(network: Network) -> None:
    one, other = (
        network.node(name, context=network.context(distro="humble")) for name in ("one", "other")
    )
    subscription = one.subscription("chatter", String)
    publisher = other.publisher("chatter", String)
    publisher.wait_for_subscribers()
    publisher.publish("hello")
    assert subscription.get().data == "hello"


def test_services(network: Network, log: Log) -> None:
    server, caller = network.node("server"), network.node("caller")
    server.service("add", AddTwoInts, lambda _: 0)
    caller.client("add", Empty)
    log.wait_for("node '/server' serves service '/add' with type 'example_interfaces/srv/AddTwo")
    log.wait_for("node '/caller' calls service '/add' with type 'std_srvs/srv/Empty'")


def test_same_types_are_no_news(network: Network, log: Log) -> None:
    talker, listener = network.node("talker"), network.node("listener")
    talker.publisher("chatter", String)
    listener.subscription("chatter", String)
    talker.publisher("other", String)
    listener.subscription("third", Int32)
    see_each_other(talker, listener)
    talker.context.graph.wait_for_subscribers("/third", 1, TIMEOUT)
    assert "reach each other" not in log.text


def token(kind: Kind, type_name: str = "a/msg/A", type_hash: str = "RIHS01_1") -> Token:
    return Token(0, "1", 0, 1, kind, "/", "n", name="/t", type_name=type_name, type_hash=type_hash)


@pytest.mark.parametrize(
    ("own", "other", "part"),
    [
        (token(Kind.PUBLISHER), token(Kind.SUBSCRIPTION), ""),
        (token(Kind.CLIENT), token(Kind.SERVICE), ""),
        (token(Kind.PUBLISHER), token(Kind.SUBSCRIPTION, "a/msg/B"), "with type 'a/msg/B'"),
        (token(Kind.PUBLISHER), token(Kind.SUBSCRIPTION, type_hash=NO_HASH), "set ROS_DISTRO"),
        (token(Kind.CLIENT, type_hash=NO_HASH), token(Kind.SERVICE), "humble is set here"),
        (token(Kind.CLIENT), token(Kind.SERVICE, type_hash="RIHS01_2"), "another definition"),
    ],
)
def test_sentences(own: Token, other: Token, part: str) -> None:
    text = explain_incompatible(own, other)
    assert part in text
    assert bool(text) == bool(part)
