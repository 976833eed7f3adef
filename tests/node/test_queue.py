"""The queue of a subscription: order of decoding, and waking of waiters."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Callable
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.errors import ClosedError
from rosz.node import Subscription

Decode = Callable[[Any], Any]


def filled(
    network: Network, monkeypatch: pytest.MonkeyPatch, decode: Decode, *samples: Any
) -> Subscription[Any]:
    """Return a subscription with some samples in its queue."""
    subscription = network.node().subscription("chatter")
    decoder = SimpleNamespace(decode=lambda sample: (decode(sample), None))
    monkeypatch.setattr(subscription._decoders, "of_sample", lambda _: decoder)
    for sample in samples:
        subscription._receive(sample)
    return subscription


def test_samples_are_decoded_in_their_order_whoever_receives_them(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A decoder drops a sample with a number below the last where samples may come twice."""
    both = threading.Barrier(2)
    decoded: list[Any] = []

    def decode(sample: Any) -> Any:
        if sample == 1:
            with suppress(threading.BrokenBarrierError):
                both.wait(0.1)
        decoded.append(sample)
        if sample == 2:
            with suppress(threading.BrokenBarrierError):
                both.wait(0.1)
        return sample

    subscription = filled(network, monkeypatch, decode, 1, 2)
    threads = [network.thread(lambda: subscription.get(TIMEOUT)) for _ in range(2)]
    for thread in threads:
        thread.join()
    assert decoded == [1, 2]


def test_a_loop_that_was_closed_is_not_woken_any_more(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    subscription = filled(network, monkeypatch, lambda sample: sample)
    queue = subscription._queue
    loop = asyncio.new_event_loop()

    async def collect() -> None:
        async for _ in subscription:
            pass

    task = loop.create_task(collect())
    loop.run_until_complete(asyncio.sleep(0))
    waiting = [len(queue._wakers)]
    loop.close()
    subscription._receive(1)  # type: ignore[arg-type]
    waiting.append(len(queue._wakers))
    assert waiting == [1, 0]
    task.get_coro().close()
    task._log_destroy_pending = False  # type: ignore[attr-defined]


def test_a_wait_without_end_ends_with_the_subscription(network: Network) -> None:
    subscription = network.node().subscription("chatter")
    threading.Timer(0.05, subscription.close).start()
    with pytest.raises(ClosedError, match="the subscription of '/chatter' is closed"):
        subscription.get(math.inf)
