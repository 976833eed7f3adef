"""What the clients of a bridge ask for that takes long."""

from __future__ import annotations

import threading
from contextlib import closing
from queue import SimpleQueue

import pytest
from network import TIMEOUT

from rosz.bridges.clients import ClientTasks, task_worker
from rosz.errors import UsageError


def test_others_find_threads() -> None:
    """Tasks of one client that do not end leave threads for those of another."""
    go_on, done = threading.Event(), threading.Semaphore(0)

    def wait() -> None:
        go_on.wait(TIMEOUT)
        done.release()

    with closing(task_worker("tasks")) as worker:
        one, other = ClientTasks(worker, 9_000), ClientTasks(worker, 9_000)
        for _ in range(900):
            one.submit(wait, 10)
        with pytest.raises(UsageError, match="9000 bytes have not ended"):
            one.submit(wait, 10)
        other.submit(done.release, 20_000)  # a large one alone
        assert done.acquire(timeout=TIMEOUT)
        assert not go_on.is_set()
        go_on.set()
        assert all(done.acquire(timeout=TIMEOUT) for _ in range(900))


def test_a_client_that_leaves() -> None:
    go_on, ended = threading.Event(), threading.Event()
    performed: SimpleQueue[bool] = SimpleQueue()

    def wait() -> None:
        performed.put(go_on.wait(TIMEOUT))

    with closing(task_worker("tasks")) as worker:
        tasks = ClientTasks(worker, 1000)
        for _ in range(100):
            tasks.submit(wait, 1)
        tasks.close()
        go_on.set()
        ClientTasks(worker, 1).submit(ended.set, 1)
        assert ended.wait(TIMEOUT)
        assert performed.get(timeout=TIMEOUT)
    assert performed.qsize() < 99
