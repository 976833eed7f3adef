"""Threads for work: as many as are needed and to be had, and never none."""

from __future__ import annotations

import threading
from queue import SimpleQueue

import pytest
from network import PATIENCE

from rosz.node import pool
from rosz.node.pool import Jobs, Pool


def test_work_goes_on_where_the_system_has_no_more_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    jobs: Jobs[int] = Jobs()
    done: SimpleQueue[tuple[int, threading.Thread]] = SimpleQueue()
    Pool(2, "workers", jobs.take, lambda job: done.put((job, threading.current_thread())))

    def refuse(_thread: threading.Thread) -> bool:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(pool, "start", refuse)
        for number in range(3):
            jobs.put(number)
        workers = [done.get(timeout=PATIENCE) for _ in range(3)]
    assert [number for number, _ in workers] == [0, 1, 2]
    assert len({thread for _, thread in workers}) == 1
    jobs.put(3)
    assert done.get(timeout=PATIENCE)[0] == 3
    jobs.close()


def test_more_threads_come_when_there_are_some_again(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs: Jobs[int] = Jobs()
    both = threading.Barrier(2)
    done: SimpleQueue[int] = SimpleQueue()

    def work(job: int) -> None:
        if job:
            both.wait(PATIENCE)
        done.put(job)

    Pool(2, "workers", jobs.take, work)
    with monkeypatch.context() as patched:
        patched.setattr(pool, "start", lambda _thread: False)
        jobs.put(0)
        assert done.get(timeout=PATIENCE) == 0
    for number in (1, 2):  # each waits for the other
        jobs.put(number)
    assert {done.get(timeout=PATIENCE) for _ in range(2)} == {1, 2}
    jobs.close()
