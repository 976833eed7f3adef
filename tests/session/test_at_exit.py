"""A program does not end while a thread of it is inside Zenoh."""

from __future__ import annotations

import threading
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.session import declared
from rosz.session.channels import declare_callback
from rosz.session.declared import Callbacks


def test_a_thread_that_leaves_late_is_waited_for(network: Network) -> None:
    """On a busy machine, it takes seconds; the Python runtime would abort the program."""
    program = network.program(
        """
        import threading
        from pathlib import Path
        import rosz.session

        inside = threading.Event()
        text = "def call():\\n inside.set()\\n pause.wait(2)\\n print('has left')"
        names = {"inside": inside, "pause": threading.Event(), "print": print}
        exec(compile(text, str(Path(rosz.session.__file__).with_name("call.py")), "exec"), names)
        threading.Thread(target=names["call"], daemon=True).start()
        inside.wait()
        """
    )
    assert program.exit_code() == 0
    assert program.lines == ["has left"]


def test_a_thread_of_zenoh_that_has_removed_its_queue_is_waited_for(network: Network) -> None:
    """The Python runtime would abort the program if the thread returned to Python after the end."""
    program = network.program(
        """
        import threading, time
        from rosz.session import at_exit, channels
        from rosz.node import Context

        late = threading.Event()

        class Open(set):
            def discard(self, queue):
                super().discard(queue)
                if threading.current_thread().name.endswith("(pyo3-closure)"):
                    print("leaves")
                    late.set()
                    time.sleep(1)  # the thread is slow
                    print("has left")

        at_exit.OPEN = channels.OPEN = Open()
        with Context() as context:
            context.session.watch_tokens("a/*", lambda *change: None)
        late.wait()
        """
    )
    assert program.exit_code() == 0
    assert program.lines.count("has left") == program.lines.count("leaves") > 0


class Entity:
    """What Zenoh returns for a declaration."""

    def undeclare(self) -> None:
        """Do nothing."""


def test_a_thread_of_zenoh_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has left Python only when it has closed its channel, also while the program ends."""
    ending = threading.Event()
    monkeypatch.setattr(declared, "ENDING", ending)
    handlers: list[Any] = []
    received: SimpleQueue[int] = SimpleQueue()

    def declare(handler: Any) -> Entity:
        handlers.append(handler)
        return Entity()

    def callback(item: int) -> None:
        ending.set()
        received.put(item)

    declaration = Callbacks("test", declare_callback(declare), callback)
    (handler,) = handlers
    for item in (1, 2):
        handler.callback(item)
    assert [received.get(timeout=TIMEOUT) for _ in range(2)] == [1, 2]
    handler.drop()
    declaration.close()
