"""The first message arrives, and the last: a program may publish once and end."""

from __future__ import annotations

import threading
import time
from queue import Empty, SimpleQueue

import pytest
from network import TIMEOUT, Network, repeats

from rosz.msgs.std_msgs.msg import String
from rosz.node import Context, standard
from rosz.session import LocalPeers, MeshReadiness, mesh, serve_links
from rosz.session.local_peers import LocalPeer, LocalRegistration

ONE_SHOT = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String

    with rosz.Node("one_shot", anonymous=True) as node:
        node.publisher("chatter", String, latch=sys.argv[2] == "latch").publish(sys.argv[1])
"""

NEVER_CLOSED = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String

    node = rosz.Node("one_shot", anonymous=True)
    node.publisher("chatter", String).publish(sys.argv[1])
"""


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("kind", ["plain", "latch"])
def test_published_once_by_a_program_that_ends(network: Network, kind: str) -> None:
    """The subscriber is not the meeting point: the programs have to find it first."""
    network.context()
    got: SimpleQueue[str] = SimpleQueue()
    listener = network.node("listener")
    listener.subscription("chatter", String, lambda m: got.put(m.data))
    listener.context.mesh.ready.wait(TIMEOUT)
    lost = []
    for number in range(repeats(10, 1000)):
        program = network.program(ONE_SHOT, str(number), kind)
        assert program.exit_code() == 0, program.output
        program.close()
        try:
            assert got.get(timeout=TIMEOUT) == str(number)
        except Empty:
            lost.append(number)
    assert not lost


def test_never_closed(network: Network) -> None:
    network.context()
    subscription = network.node("listener").subscription("chatter", String)
    program = network.program(NEVER_CLOSED, "hello")
    assert subscription.get().data == "hello"
    assert program.exit_code() == 0


def test_order_of_what_is_held(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """Held samples come first, then the later ones, numbered without gaps."""
    monkeypatch.setattr(standard, "follow_clock", lambda _: None)
    network.context()
    got: SimpleQueue[tuple[str, int]] = SimpleQueue()
    network.node("listener").subscription(
        "chatter",
        String,
        lambda m, info: got.put((m.data, info.sequence)),
        queue_size=2000,
        with_info=True,
    )
    talker = network.node("talker")
    publisher = talker.publisher("chatter", String)
    for number in range(500):
        publisher.publish(str(number))
    assert talker.context.mesh.ready.wait(TIMEOUT)
    publisher.publish("500")
    assert [got.get(timeout=TIMEOUT) for _ in range(501)] == [(str(n), n + 1) for n in range(501)]


def test_what_is_held_is_bounded(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """The newest thousand are kept."""
    monkeypatch.setattr(Context, "MESH_TIMEOUT", 0.1)
    monkeypatch.setattr(Context, "HOLD_TIMEOUT", TIMEOUT)
    network.context()
    subscription = network.node("listener").subscription("chatter", String, queue_size=2000)
    monkeypatch.setattr(standard, "follow_clock", lambda _: None)  # waits for the same as we do
    linked = threading.Event()
    strangers = {"somebody who is linked late"}
    monkeypatch.setattr(
        MeshReadiness, "_missing", lambda *_: set() if linked.is_set() else strangers
    )
    publisher = network.node("talker").publisher("chatter", String)
    for number in range(1500):
        publisher.publish(str(number))
    publisher.wait_for_subscribers()  # over the link that `_missing` only pretends to wait for
    linked.set()
    assert subscription.get().data == "500"
    assert publisher.dropped == 500


def test_bytes_that_are_held_are_bounded(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosz.node.publisher._HELD_BYTES", 100_000)
    monkeypatch.setattr(Context, "MESH_TIMEOUT", 0.1)
    monkeypatch.setattr(Context, "HOLD_TIMEOUT", TIMEOUT)
    network.context()
    subscription = network.node("listener").subscription("chatter", String, queue_size=2000)
    monkeypatch.setattr(standard, "follow_clock", lambda _: None)
    linked = threading.Event()
    strangers = {"somebody who is linked late"}
    monkeypatch.setattr(
        MeshReadiness, "_missing", lambda *_: set() if linked.is_set() else strangers
    )
    publisher = network.node("talker").publisher("chatter", String)
    for number in range(20):
        publisher.publish(str(number) + " " * 10_000)
    publisher.wait_for_subscribers()
    linked.set()
    assert int(subscription.get().data) == publisher.dropped == 11


def test_held_for_as_long_as_links_come(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine may take longer than others wait for the mesh."""
    network.context()
    subscription = network.node("listener").subscription("chatter", String)
    monkeypatch.setattr(standard, "follow_clock", lambda _: None)
    monkeypatch.setattr(Context, "MESH_TIMEOUT", 0.1)
    monkeypatch.setattr(Context, "HOLD_TIMEOUT", TIMEOUT)
    linked = threading.Event()
    strangers = {"somebody who is linked late"}
    monkeypatch.setattr(
        MeshReadiness, "_missing", lambda *_: set() if linked.is_set() else strangers
    )
    talker = network.node("talker")
    publisher = talker.publisher("chatter", String)
    publisher.publish("first")
    assert talker.context.mesh.ready.wait(TIMEOUT)
    publisher.publish("second")
    assert not subscription._queue.items
    publisher.wait_for_subscribers()
    linked.set()
    assert [subscription.get().data for _ in range(2)] == ["first", "second"]


def test_time_of_holding_is_bounded(
    network: Network, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Held samples are sent in the end, even if a peer is never linked, which is told."""
    network.context()
    subscription = network.node("listener").subscription("chatter", String)
    monkeypatch.setattr(standard, "follow_clock", lambda _: None)
    monkeypatch.setattr(MeshReadiness, "_missing", lambda *_: {"somebody who is never linked"})
    monkeypatch.setattr(Context, "MESH_TIMEOUT", 0.5)
    monkeypatch.setattr(Context, "HOLD_TIMEOUT", 1.0)
    began = time.monotonic()
    network.node("talker").publisher("chatter", String).publish("hello")
    assert subscription.get().data == "hello"
    assert time.monotonic() - began >= 1.0
    assert "not linked to 1 other session(s)" in caplog.text


def test_one_that_begins_at_the_same_moment(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is waited for, although it was not there yet when this one began."""
    read = LocalPeers.read
    registrations: list[LocalRegistration] = []

    def read_before(rendezvous: str, own: LocalPeer | None = None) -> LocalPeers:
        peers = read(rendezvous, own)
        if own is None:
            registrations.append(LocalRegistration(rendezvous))
        return peers

    with monkeypatch.context() as patch:
        patch.setattr(Context, "MESH_TIMEOUT", TIMEOUT)
        patch.setattr(LocalPeers, "read", read_before)
        context = network.context()
    assert not context.mesh.ready.is_set()
    other = network.session()
    assert context.mesh.ready.wait(TIMEOUT)
    assert context.session.peers() == [other.zid]
    (registration,) = registrations
    registration.close()


def test_a_busy_peer_may_know_others(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """A peer of this machine that has not told its links yet is waited for."""
    monkeypatch.setattr(mesh, "_BUSY_SECONDS", TIMEOUT)
    busy = network.session()
    newcomer = network.context().mesh
    assert not newcomer.linked.wait(3 * mesh._SILENT_SECONDS)
    served = serve_links(busy)
    assert newcomer.linked.wait(TIMEOUT)
    served.close()


def test_nobody_else_no_wait(network: Network) -> None:
    """The first process has no peer to wait for."""
    talker = network.node("talker")
    assert talker.context.mesh.ready.is_set()
