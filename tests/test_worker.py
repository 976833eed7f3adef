"""The bounded worker, and lent threads: order, bounds, delays, and where there are no threads."""

from __future__ import annotations

import logging
import threading
from collections import deque
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network, eventually

from rosz import worker
from rosz.errors import ClosedError
from rosz.worker import Worker, lend_thread, start_thread


def test_items_are_handled_in_order_on_one_thread() -> None:
    handled: list[tuple[int, str]] = []
    numbers: Worker[int] = Worker(
        "numbers", lambda item: handled.append((item, threading.current_thread().name))
    )
    for number in range(100):
        numbers.submit(number)
    assert numbers.flush(TIMEOUT)
    numbers.close()
    assert handled == [(number, "numbers") for number in range(100)]


def test_a_failing_item_is_logged_and_the_next_one_handled(
    caplog: pytest.LogCaptureFixture,
) -> None:
    tasks: Worker[object] = Worker("tasks", lambda item: item.missing)  # type: ignore[attr-defined]
    with caplog.at_level(logging.ERROR):
        tasks.submit(object())
        tasks.submit(object())
        assert tasks.flush(TIMEOUT)
    tasks.close()
    assert caplog.text.count("tasks: handling an item failed") == 2


def test_closed_errors_are_not_logged_once_it_is_closed(caplog: pytest.LogCaptureFixture) -> None:
    entered, release = threading.Event(), threading.Event()

    def task() -> None:
        entered.set()
        release.wait(TIMEOUT)
        raise ClosedError("the session is closed")

    tasks: Worker[object] = Worker("tasks")
    tasks.submit(task)
    assert entered.wait(TIMEOUT)
    tasks.close(timeout=0)
    release.set()
    tasks.close(TIMEOUT)
    assert "failed" not in caplog.text


def test_close_handles_what_is_queued_and_drops_the_rest() -> None:
    handled: list[int] = []
    numbers: Worker[int] = Worker("numbers", handled.append)
    numbers.later(3600, -1)
    numbers.submit(1)
    numbers.submit(2)
    numbers.close(TIMEOUT)
    numbers.close(TIMEOUT)
    numbers.submit(3)
    assert not numbers.offer(4)
    assert handled == [1, 2]


def test_delayed_items_come_by_their_time() -> None:
    handled: SimpleQueue[int] = SimpleQueue()
    numbers: Worker[int] = Worker("numbers", handled.put)
    numbers.later(0.05, 2)
    numbers.later(0.01, 1)
    numbers.submit(0)
    assert [handled.get(timeout=TIMEOUT) for _ in range(3)] == [0, 1, 2]
    numbers.close()


def test_offer_refuses_beyond_the_capacity_and_tells_when_free() -> None:
    gate, entered, free = threading.Event(), threading.Event(), threading.Event()

    def handle(_text: str) -> None:
        entered.set()
        gate.wait(TIMEOUT)

    texts: Worker[str] = Worker("texts", handle, capacity=10, size=len)
    texts.submit("x" * 6)
    assert entered.wait(TIMEOUT)
    assert texts.offer("y" * 6)
    assert texts.full
    assert not texts.offer("z")
    texts.when_free(free.set)
    assert not free.is_set()
    gate.set()
    assert free.wait(TIMEOUT)
    assert texts.flush(TIMEOUT)
    assert texts.waiting == 0
    texts.when_free(free.clear)
    assert not free.is_set()
    texts.close()


def test_flush_of_a_busy_worker_times_out() -> None:
    gate = threading.Event()
    tasks: Worker[object] = Worker("tasks")
    tasks.submit(lambda: gate.wait(TIMEOUT))
    assert not tasks.flush(0.01)
    gate.set()
    assert tasks.flush(TIMEOUT)
    tasks.close(TIMEOUT)


def test_a_task_may_flush_and_close_its_own_worker() -> None:
    flushed: SimpleQueue[bool] = SimpleQueue()
    tasks: Worker[object] = Worker("tasks")

    def task() -> None:
        flushed.put(tasks.flush(TIMEOUT))
        tasks.close()
        flushed.put(tasks.closed)

    tasks.submit(task)
    assert flushed.get(timeout=TIMEOUT)
    assert flushed.get(timeout=TIMEOUT)
    tasks.close(TIMEOUT)


def test_several_threads_handle_items_at_once() -> None:
    both = threading.Barrier(2)
    done: SimpleQueue[int] = SimpleQueue()

    def handle(item: int) -> None:
        both.wait(TIMEOUT)
        done.put(item)

    numbers: Worker[int] = Worker("numbers", handle, threads=2)
    numbers.submit(1)
    numbers.submit(2)
    assert {done.get(timeout=TIMEOUT) for _ in range(2)} == {1, 2}
    numbers.close(TIMEOUT)


def test_items_of_another_queue_are_received_until_none() -> None:
    queue: SimpleQueue[int | None] = SimpleQueue()
    done: SimpleQueue[int] = SimpleQueue()
    numbers: Worker[int] = Worker("numbers", done.put, receive=queue.get)
    queue.put(1)
    queue.put(2)
    assert [done.get(timeout=TIMEOUT) for _ in range(2)] == [1, 2]
    queue.put(None)
    numbers.close(TIMEOUT)
    assert not [thread for thread in threading.enumerate() if thread.name == "numbers"]


@pytest.mark.parametrize("answer", [False, RuntimeError("can't start new thread")])
def test_work_goes_on_where_the_system_has_no_more_threads(
    monkeypatch: pytest.MonkeyPatch, answer: bool | RuntimeError
) -> None:
    done: SimpleQueue[tuple[int, threading.Thread]] = SimpleQueue()
    numbers: Worker[int] = Worker(
        "numbers", lambda item: done.put((item, threading.current_thread())), threads=2
    )
    first = threading.Event()

    def refuse_all_but_the_first(thread: threading.Thread) -> bool:
        if not first.is_set():
            first.set()
            thread.start()
            return True
        if isinstance(answer, RuntimeError):
            raise answer
        return False

    with monkeypatch.context() as patched:
        patched.setattr(worker, "start_thread", refuse_all_but_the_first)
        for number in range(3):
            numbers.submit(number)
        handled = [done.get(timeout=TIMEOUT) for _ in range(3)]
    assert [number for number, _ in handled] == [0, 1, 2]
    assert len({thread for _, thread in handled}) == 1
    both = threading.Barrier(2)
    numbers._handle = lambda _: both.wait(TIMEOUT)
    numbers.submit(3)
    numbers.submit(4)
    assert numbers.flush(TIMEOUT)
    numbers.close(TIMEOUT)
    assert not both.broken


AT_THE_END = """
import atexit
import threading
from rosz.worker import start_thread
atexit.register(lambda: print(start_thread(threading.Thread(target=threading.get_ident))))
"""


def test_starting_a_thread_at_the_end_of_the_process(network: Network) -> None:
    program = network.program(AT_THE_END)
    assert program.exit_code() == 0
    assert program.lines in (["True"], ["False"])


def test_starting_a_thread_twice_is_an_error() -> None:
    thread = threading.Thread(target=threading.get_ident)
    assert start_thread(thread)
    with pytest.raises(RuntimeError, match="once"):
        start_thread(thread)
    thread.join()


def test_as_many_threads_are_lent_as_there_are_tasks() -> None:
    all_at_once = threading.Barrier(20)
    done: SimpleQueue[threading.Thread] = SimpleQueue()

    def task() -> None:
        all_at_once.wait(TIMEOUT)
        done.put(threading.current_thread())

    assert all(lend_thread(task) for _ in range(20))
    threads = {done.get(timeout=TIMEOUT) for _ in range(20)}
    assert len(threads) == 20
    assert all(thread.daemon for thread in threads)


def test_a_thread_is_lent_again_after_a_task_that_fails(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(worker, "_free_threads", deque())
    monkeypatch.setattr(worker, "_tasks", SimpleQueue())
    used: SimpleQueue[int] = SimpleQueue()

    def task() -> None:
        used.put(threading.get_ident())
        raise ValueError("no such thing")

    with caplog.at_level(logging.ERROR):
        assert lend_thread(task)
        first = used.get(timeout=TIMEOUT)
        eventually(lambda: bool(worker._free_threads), "the end of the task")
        assert lend_thread(task)
    assert used.get(timeout=TIMEOUT) == first
    assert "no such thing" in caplog.text


def test_a_thread_that_nobody_uses_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "_LENT_SECONDS", 0.0)
    monkeypatch.setattr(worker, "_free_threads", deque())
    monkeypatch.setattr(worker, "_tasks", SimpleQueue())
    used: SimpleQueue[threading.Thread] = SimpleQueue()
    for _ in range(200):  # some while a thread is about to end
        assert lend_thread(lambda: used.put(threading.current_thread()))
    threads = {used.get(timeout=TIMEOUT) for _ in range(200)}
    for thread in threads:
        thread.join(TIMEOUT)
    assert not any(thread.is_alive() for thread in threads)
    assert not worker._free_threads


def test_no_thread_is_lent_where_the_system_has_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: threading.Thread) -> bool:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(worker, "start_thread", refuse)
    monkeypatch.setattr(worker, "_free_threads", deque())
    assert not lend_thread(threading.get_ident)


FORK = """
import os
from queue import SimpleQueue
from rosz.worker import lend_thread

done = SimpleQueue()
lend_thread(lambda: done.put("parent"))
print(done.get(), flush=True)
child = os.fork()
if not child:
    lend_thread(lambda: done.put("child"))
    print(done.get(), flush=True)
    os._exit(0)
os.waitpid(child, 0)
"""


def test_threads_are_lent_in_a_forked_child(network: Network) -> None:
    program = network.program(FORK)
    assert program.exit_code() == 0
    assert program.lines == ["parent", "child"]
