"""Waits with an invalid timeout raise, rather than end at once or never."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.errors import UsageError, WaitTimeout
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import Int32
from rosz.node import Node
from rosz.params.replica import ParamClient

WAITS: dict[str, Callable[[Node, float], Any]] = {
    "get": lambda node, value: node.subscription("x", Int32).get(value),
    "subscribers": lambda node, value: node.publisher("x", Int32).wait_for_subscribers(1, value),
    "service": lambda node, value: node.client("s", AddTwoInts).wait_for_service(value),
    "client": lambda node, value: node.client("s", AddTwoInts, timeout=value),
    "call": lambda node, value: node.client("s", AddTwoInts)(1, 2, timeout=value),
    "shutdown": lambda node, value: node.context.wait_for_shutdown(value),
    "graph": lambda node, value: node.context.graph.wait_for_node("/nobody", value),
    "refresh": lambda node, value: node.context.graph.refresh(value),
    "set": lambda node, value: node.params.set("x", 1, timeout=value),
    "compare": lambda node, value: node.context.params.compare(value),
    "remote": lambda node, value: ParamClient(node.context.session, timeout=value),
    "question": lambda node, value: node.context.session.get("a", timeout=value),
    "tokens": lambda node, value: node.context.session.live_tokens("a", value),
    "timer": lambda node, value: node.timer(1000, print).join(value),
}
SPANS: dict[str, Callable[[Node, float], Any]] = {
    "period": lambda node, value: node.timer(value, print),
    "sleep": lambda node, value: node.sleep(value),
    "rate": lambda node, value: node.rate(value),
    "throttle": lambda node, value: node.log.info("text", throttle=value),
}


@pytest.mark.parametrize("wait", WAITS.values(), ids=WAITS)
def test_no_number_is_no_timeout(network: Network, wait: Callable[[Node, float], Any]) -> None:
    with pytest.raises(UsageError, match="timeout is 'nan': expected a number of seconds"):
        wait(network.node(), math.nan)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("span", SPANS.values(), ids=SPANS)
def test_no_number_is_no_span(
    network: Network, span: Callable[[Node, float], Any], value: float
) -> None:
    with pytest.raises(UsageError, match=f"'{value}'"):
        span(network.node(), value)


def test_a_set_that_is_refused_sets_nothing(network: Network) -> None:
    node = network.node()
    with pytest.raises(UsageError):
        node.params.set("x", 1, timeout=math.nan)
    assert "x" not in node.params


def test_rate_beyond_all_time(network: Network) -> None:
    with pytest.raises(UsageError, match="rate is '1e-310' Hz"):
        network.node().rate(1e-310)


def test_less_than_nothing_is_nothing(network: Network) -> None:
    node = network.node()
    client = node.client("s", AddTwoInts, timeout=-1.0)
    assert client.timeout == 0
    assert not node.context.wait_for_shutdown(-math.inf)
    with pytest.raises(WaitTimeout, match="within -1 s"):
        node.subscription("x", Int32).get(-1.0)
    network.node("server").service("s", AddTwoInts, lambda _: 1)
    client.wait_for_service(TIMEOUT)
    with pytest.raises(WaitTimeout, match="answer of service '/s' within 0 s"):
        client(1, 2)


def test_for_ever(network: Network) -> None:
    node = network.node()
    network.node("server").service("s", AddTwoInts, lambda request: request.a + request.b)
    client = node.client("s", AddTwoInts, timeout=math.inf)
    client.wait_for_service(math.inf)
    assert client(1, 2).sum == client(1, 2, timeout=1e300).sum == 3
    node.params.set("x", 1, timeout=math.inf)
    timer = node.timer(1000, print)
    network.thread(timer.close)
    assert timer.join(math.inf)
    network.thread(node.context.shutdown)
    assert node.context.wait_for_shutdown(math.inf)
