"""`rosz.lifecycle`: closing once, in order, from any thread, and in a forked child."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable

import pytest
from network import TIMEOUT

from rosz import lifecycle
from rosz.errors import ClosedError
from rosz.lifecycle import Lifecycle, Registration


def part(name: str, done: list[str]) -> Registration:
    return Registration(lambda: done.append(name))


def test_states() -> None:
    life = Lifecycle("the feed")
    seen: list[tuple[bool, bool]] = []
    life.on_close(lambda _: seen.append((life.closing, life.closed)))
    assert (life.closing, life.closed) == (False, False)
    assert life.close(lambda: seen.append((life.closing, life.closed)))
    assert seen == [(True, False), (True, False)]
    assert (life.closing, life.closed) == (True, True)


def test_order() -> None:
    """First the owner, then the hooks and the parts, the newest first."""
    done: list[str] = []
    life = Lifecycle("the node")
    life.keep(part("old part", done))
    life.on_close(lambda reason: done.append(f"old hook: {reason}"))
    life.keep(part("new part", done))
    life.on_close(lambda reason: done.append(f"new hook: {reason}"))
    life.close(lambda: done.append("finish"), first=lambda: done.append("first"), reason="bye")
    assert done == ["first", "new hook: bye", "old hook: bye", "finish", "new part", "old part"]


def test_closes_once() -> None:
    done: list[str] = []
    life = Lifecycle("the node")
    for _ in range(3):
        assert life.close(lambda: done.append("finish"))
    assert done == ["finish"]


def test_early_reason() -> None:
    life = Lifecycle("the context")
    life.reason = "SIGINT"
    life.close()
    assert life.reason == "SIGINT"
    with pytest.raises(ClosedError, match=r"^cannot publish: the context is closed: SIGINT$"):
        life.check_open("publish")


def test_check_open() -> None:
    life = Lifecycle("the publisher of '/chatter'")
    life.check_open("publish")
    life.close()
    with pytest.raises(
        ClosedError, match=r"^cannot publish: the publisher of '/chatter' is closed$"
    ):
        life.check_open("publish")


def test_forgotten() -> None:
    done: list[str] = []
    life = Lifecycle("the node")
    gone = life.keep(part("gone", done))
    life.keep(part("stays", done))
    remove = life.on_close(lambda _: done.append("hook"))
    for _ in range(2):
        life.forget(gone)
        remove()
    life.close()
    assert done == ["stays"]


def test_too_late() -> None:
    """What comes after the end is closed at once, or refused."""
    done: list[str] = []
    life = Lifecycle("the node")
    life.close()
    with pytest.raises(ClosedError, match="the node is closed"):
        life.keep(part("late", done))
    with pytest.raises(ClosedError, match="the node is closed"):
        life.on_close(lambda _: done.append("hook"))
    assert done == ["late"]


def test_failures_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    def fail(*_: object) -> None:
        raise ValueError("broken")

    def leave(*_: object) -> None:
        raise SystemExit(1)

    done: list[str] = []
    life = Lifecycle("the node")
    life.keep(part("part", done))
    life.keep(Registration(fail))
    life.on_close(fail)
    life.on_close(leave)
    with caplog.at_level(logging.ERROR):
        assert life.close()
    assert done == ["part"]
    assert [record.getMessage() for record in caplog.records] == [
        "a shutdown hook failed",
        "a shutdown hook failed",
        "a part of the node could not be closed",
    ]


def test_interrupted_hook() -> None:
    """Ctrl-C ends the hooks; the parts are closed nevertheless."""

    def interrupt(_: str) -> None:
        raise KeyboardInterrupt

    done: list[str] = []
    life = Lifecycle("the node")
    life.keep(part("part", done))
    life.on_close(interrupt)
    with pytest.raises(KeyboardInterrupt):
        life.close(lambda: done.append("finish"))
    assert done == ["finish", "part"]
    assert life.closed


def test_own_thread_does_not_wait() -> None:
    """A hook or a part may close its owner."""
    inner: list[bool] = []
    life = Lifecycle("the node")
    life.on_close(lambda _: inner.append(life.close()))
    life.keep(Registration(lambda: inner.append(life.close())))
    assert life.close()
    assert inner == [False, False]


def held(life: Lifecycle) -> tuple[threading.Thread, Callable[[], None]]:
    """Close on another thread, which stays in a hook until released."""
    began, go_on = threading.Event(), threading.Event()

    def hook(_: str) -> None:
        began.set()
        go_on.wait(TIMEOUT)

    life.on_close(hook)
    thread = threading.Thread(target=life.close)
    thread.start()
    assert began.wait(TIMEOUT)
    return thread, go_on.set


def test_second_caller_waits() -> None:
    life = Lifecycle("the node")
    first, release = held(life)
    results: list[tuple[bool, bool]] = []
    second = threading.Thread(target=lambda: results.append((life.close(), life.closed)))
    second.start()
    assert not results
    release()
    first.join(TIMEOUT)
    second.join(TIMEOUT)
    assert results == [(True, True)]


def test_second_caller_gives_up(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(lifecycle, "_CLOSE_TIMEOUT", 0.01)
    life = Lifecycle("the node")
    first, release = held(life)
    assert not life.close()
    assert "closing the node takes more than 0.01 s" in caplog.text
    release()
    first.join(TIMEOUT)
    assert life.close()


def test_wait_closing() -> None:
    life = Lifecycle("the node")
    assert not life.wait_closing(0.01)
    waiters = [threading.Thread(target=life.wait_closing) for _ in range(3)]
    for waiter in waiters:
        waiter.start()
    life.close()
    for waiter in waiters:
        waiter.join(TIMEOUT)
        assert not waiter.is_alive()
    assert life.wait_closing()


def test_signal_handler_closes() -> None:
    """The handler runs on the very thread that waits."""
    life = Lifecycle("the node")
    previous = signal.signal(signal.SIGUSR1, lambda *_: life.close())
    try:
        timer = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGUSR1))
        timer.start()
        assert life.wait_closing(TIMEOUT)
        timer.join()
    finally:
        signal.signal(signal.SIGUSR1, previous)


def test_many_closers() -> None:
    """Of many threads one closes, and all return when that is done."""
    for _ in range(50):
        life = Lifecycle("the node")
        done: list[str] = []
        life.keep(part("part", done))
        barrier = threading.Barrier(4)
        results: list[bool] = []

        def close(
            life: Lifecycle = life,
            barrier: threading.Barrier = barrier,
            results: list[bool] = results,
        ) -> None:
            barrier.wait(TIMEOUT)
            results.append(life.close() and life.closed)

        threads = [threading.Thread(target=close) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(TIMEOUT)
        assert done == ["part"]
        assert results == [True] * 4


FORK = """
import os
from rosz.errors import ClosedError
from rosz.lifecycle import Lifecycle, Registration

class Owner:
    def __init__(self):
        self.life = Lifecycle("the owner", on_fork=self.forked)
        self.life.keep(Registration(lambda: print("part", flush=True)))
        self.life.on_close(lambda reason: print("hook", flush=True))
    def forked(self):
        print("forked", flush=True)

owner, gone = Owner(), Owner()
del gone
if not os.fork():
    assert owner.life.closing and owner.life.closed and owner.life.forked
    assert owner.life.wait_closing() and owner.life.close()
    try:
        owner.life.check_open("publish")
    except ClosedError as error:
        print(error, flush=True)
    fresh = Lifecycle("the child's own")
    fresh.check_open("publish")
    os._exit(0)
assert os.wait()[1] == 0
assert not owner.life.closing
owner.life.close()
"""


def test_forked_child() -> None:
    result = subprocess.run(
        [sys.executable, "-c", FORK], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.returncode == 0, result.stderr
    told, refused, *parent = result.stdout.splitlines()
    assert told == "forked"
    assert refused == f"cannot publish: the owner is closed: {lifecycle.FORKED}"
    assert parent == ["hook", "part"]
