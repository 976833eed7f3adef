"""What is dropped is counted, and told where nobody asked for the newest only."""

from __future__ import annotations

import threading

import msgspec
import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.std_msgs.msg import Int32
from rosz.node import MessageInfo, Node, Subscription
from rosz.qos import QoS
from rosz.wire import dropped_key

_BURST = 2000


def burst(
    network: Network, *, queue_size: int = 10, qos: QoS | None = None
) -> tuple[Node, Subscription[Int32], list[tuple[int, int]]]:
    """Publish a burst while a callback is busy; return what comes, and how many are lost before."""
    talker, listener = network.node("talker"), network.node("listener")
    began, go_on = threading.Event(), threading.Event()
    got: list[tuple[int, int]] = []

    def slow(message: Int32, info: MessageInfo) -> None:
        got.append((message.data, info.lost))
        began.set()
        assert go_on.wait(TIMEOUT)

    subscription = listener.subscription(
        "count", Int32, slow, queue_size=queue_size, qos=qos, with_info=True
    )
    publisher = talker.publisher("count", Int32)
    publisher.wait_for_subscribers()
    publisher.publish(data=0)
    assert began.wait(TIMEOUT)
    for number in range(1, _BURST):
        publisher.publish(data=number)
    go_on.set()
    eventually(lambda: bool(got) and got[-1][0] == _BURST - 1, "the last message")
    return listener, subscription, got


def test_dropped_by_a_queue(network: Network, capfd: pytest.CaptureFixture[str]) -> None:
    listener, subscription, got = burst(network)
    assert subscription.dropped == sum(lost for _, lost in got) == _BURST - len(got) > 0
    (warning,) = [line for line in capfd.readouterr().err.splitlines() if "dropping" in line]
    assert "'/count'" in warning
    assert "queue_size=10" in warning
    context = listener.context
    replies = context.session.get(dropped_key(context.domain), timeout=TIMEOUT)
    counts = [msgspec.msgpack.decode(reply.payload) for reply in replies if reply.ok]
    assert counts == [{subscription.token.entity_id: subscription.dropped}]


@pytest.mark.parametrize(
    "options", [{"queue_size": 1}, {"qos": QoS(reliability="best_effort")}], ids=["one", "any"]
)
def test_asked_for_the_newest(
    network: Network,
    capfd: pytest.CaptureFixture[str],
    options: dict[str, int | QoS],
) -> None:
    """It is counted, but nothing is said."""
    _, subscription, got = burst(network, **options)  # type: ignore[arg-type]
    assert subscription.dropped == _BURST - len(got) > 0
    assert "dropping" not in capfd.readouterr().err


def test_nothing_dropped(network: Network, capfd: pytest.CaptureFixture[str]) -> None:
    _, subscription, got = burst(network, queue_size=_BURST)
    assert [number for number, _ in got] == [*range(_BURST)]
    assert subscription.dropped == 0
    assert "dropping" not in capfd.readouterr().err
