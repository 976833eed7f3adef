"""What starts early, late or again, what dies, and who must not meet."""

from __future__ import annotations

import signal

import pytest
from cli.shell import Shell
from network import TIMEOUT, eventually

from rosz.msgs.std_msgs.msg import String

from .city import ROUTED, City, Peer

MANY = 100
with_a_router = pytest.mark.parametrize("city", ROUTED, indirect=True)
CORE = ("-m", "rosz", "core")


def hear(peer: Peer, event: str, value: str) -> None:
    """Wait until hiroz hears a text; it may have heard others before."""
    while peer.next(event)["data"] != value:
        pass


@with_a_router
def test_killed(city: City, peer: Peer) -> None:
    """Each side notices that a process of the other is gone."""
    graph = city.node("rosz_side").context.graph
    graph.wait_for_node("/partner", TIMEOUT)
    peer.program.kill()
    graph.wait_for(lambda view: "/partner" not in view.nodes(), TIMEOUT, "the end of hiroz")
    watcher = city.peer("/watcher")
    script = """
        import rosz
        with rosz.Node("mortal") as node:
            node.spin()
    """
    mortal = city.program(script)
    eventually(lambda: "mortal" in watcher.nodes(), "the node in the graph of hiroz")
    mortal.kill()
    eventually(lambda: "mortal" not in watcher.nodes(), "the end of the node in the graph of hiroz")


def test_many_late_tokens(city: City, peer: Peer) -> None:
    """A hundred subscriptions that come while a node already follows the graph."""
    node = city.node("rosz_side")
    graph = node.context.graph
    graph.view()
    peer.do("topics", MANY)
    graph.wait_for(
        lambda view: sum("/many/" in topic for topic in view.topics()) == MANY, TIMEOUT, "all"
    )
    last = node.publisher(f"/many/topic_{MANY - 1}", String)
    last.wait_for_subscribers(timeout=TIMEOUT)
    last.publish("hello")
    assert peer.next(f"heard /many/topic_{MANY - 1}") == {"data": "hello"}


@with_a_router
def test_domains(city: City, peer: Peer) -> None:
    """Nodes of another domain at the same router are not seen, and hear nothing."""
    stranger = city.peer("/stranger", ROS_DOMAIN_ID="7")
    for each in (peer, stranger):
        each.do("listen", "std_msgs/msg/String", "/chatter", "-")
    node = city.node("rosz_side")
    publisher = node.publisher("/chatter", String)
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    publisher.publish("hello")
    assert peer.next("heard /chatter") == {"data": "hello"}
    far = city.node("far", context=city.context(domain=7))
    there = far.publisher("/chatter", String)
    there.wait_for_subscribers(timeout=TIMEOUT)
    there.publish("there")
    assert stranger.next("heard /chatter") == {"data": "there"}
    assert peer.program.output.count("heard /chatter") == 1
    assert "/stranger" not in node.context.graph.refresh().nodes()
    assert "/partner" not in far.context.graph.refresh().nodes()


def test_a_core_that_starts_late_and_again(
    town: City, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nodes that were there first are listed and heard by commands, and go on."""
    shell = Shell(town, monkeypatch, capsys)
    early = town.peer("/early")
    early.do("listen", "std_msgs/msg/String", "/chatter", "-")
    early.do("serve", "/add")
    for number in range(2):
        core = town.run(*CORE)
        core.wait_for("started core")
        eventually(lambda: "/early" in shell("node", "list").out, "the node of hiroz")
        eventually(lambda: "/add" in shell("service", "list").out, "its service")
        assert shell("service", "call", "/add", "20", "22").lines == ["sum: 42"]
        with town.node(f"talker{number}", context=town.context()) as talker:
            publisher = talker.publisher("/chatter", String)
            publisher.wait_for_subscribers(timeout=TIMEOUT)
            publisher.publish(str(number))
            hear(early, "heard /chatter", str(number))
        core.send(signal.SIGKILL if number else signal.SIGINT)
        core.process.wait(TIMEOUT)


@with_a_router
def test_bags(peer: Peer, shell: Shell) -> None:
    """Record what hiroz publishes, and play it to hiroz."""
    peer.do("publish", "std_msgs/msg/String", "/chatter", "-")
    recorder = shell.start("bag", "record", "-O", "heard.mcap", "/chatter", "-l", "3")
    recorder.wait_for("Subscribing to /chatter")

    def ends() -> bool:
        peer.do("publish", "std_msgs/msg/String", "/chatter", "-", '{"data": "hello"}')
        return recorder.process.poll() is not None

    eventually(ends, "the end of the recorder")
    assert recorder.exit_code() == 0
    assert "3 msgs    : std_msgs/String" in shell("bag", "info", "heard.mcap").out
    peer.do("listen", "std_msgs/msg/String", "/chatter", "keepall")
    played = shell("bag", "play", "--wait-for-subscribers", "heard.mcap")
    assert played.code == 0, played.err
    for _ in range(3):
        assert peer.next("heard /chatter") == {"data": "hello"}
