from __future__ import annotations

import asyncio
import math
import threading
from contextlib import suppress
from typing import Any

import pytest
from network import Network

from rosz.errors import ClosedError
from rosz.node.feed import Feed


def test_samples_are_decoded_in_their_order_whoever_takes_them(network: Network) -> None:
    """What decodes them drops one with a number below the last where samples may come twice."""
    feed = Feed("/chatter", 10)
    both = threading.Barrier(2)
    decoded: list[Any] = []

    def take(sample: Any) -> tuple[Any, None]:
        if sample == 1:
            with suppress(threading.BrokenBarrierError):
                both.wait(0.1)
        decoded.append(sample)
        if sample == 2:
            with suppress(threading.BrokenBarrierError):
                both.wait(0.1)
        return sample, None

    feed.put(take, 1)  # type: ignore[arg-type]
    feed.put(take, 2)  # type: ignore[arg-type]
    threads = [network.thread(lambda: feed.get(10)) for _ in range(2)]
    for thread in threads:
        thread.join()
    assert decoded == [1, 2]


def test_a_loop_that_was_closed_is_woken_no_more() -> None:
    feed = Feed("/chatter", 1)
    loop = asyncio.new_event_loop()

    async def collect() -> None:
        async for _ in feed:
            pass

    task = loop.create_task(collect())
    loop.run_until_complete(asyncio.sleep(0))
    waiting = [len(feed._loops)]
    loop.close()
    feed.put(lambda sample: (sample, None), 1)  # type: ignore[arg-type]
    waiting.append(len(feed._loops))
    assert waiting == [1, 0]
    task.get_coro().close()
    task._log_destroy_pending = False  # type: ignore[attr-defined]


def test_who_waits_forever_waits() -> None:
    feed = Feed("/chatter", 1)
    threading.Timer(0.05, feed.close).start()
    with pytest.raises(ClosedError):
        feed.get(math.inf)
