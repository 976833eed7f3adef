"""The ids of publishers in what passes from one session to another."""

from __future__ import annotations

import time
from threading import Timer

from rosz.bridges.fleet.relays import Ids

HERE, THERE = bytes(16), bytes(range(16))


def test_a_sample_waits_for_the_token_of_its_publisher() -> None:
    ids = Ids()
    timer = Timer(0.05, ids.add, (HERE, THERE))
    timer.start()
    assert ids.find(HERE) == THERE
    timer.join()


def test_samples_of_a_publisher_that_has_gone_keep_its_id() -> None:
    ids = Ids()
    ids.add(HERE, THERE)
    ids.remove(HERE)
    assert ids.find(HERE) == THERE
    ids.add(HERE, THERE)
    assert ids.find(HERE) == THERE


def test_only_the_first_sample_of_a_publisher_without_token_waits() -> None:
    ids = Ids()
    assert ids.find(HERE) is None
    began = time.monotonic()
    for _ in range(1000):
        assert ids.find(HERE) is None
    assert time.monotonic() - began < 100  # 2000 s if each waited
