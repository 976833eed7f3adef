"""A program does not end while a thread of it is inside Zenoh."""

from __future__ import annotations

import threading
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, repeats

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
        text = "def call():\\n inside.set()\\n pause.wait(0.5)\\n print('has left')"
        names = {"inside": inside, "pause": threading.Event(), "print": print}
        exec(compile(text, str(Path(rosz.session.__file__).with_name("call.py")), "exec"), names)
        threading.Thread(target=names["call"], daemon=True).start()
        inside.wait()
        """
    )
    assert program.exit_code() == 0
    assert program.lines == ["has left"]


def test_a_program_ends_while_much_arrives(network: Network) -> None:
    """The Python runtime would abort the program if a thread of Zenoh asked for its lock then."""
    ending = threading.Event()
    session = network.session()

    def flood() -> None:
        number = 0
        while not ending.is_set():
            number += 1
            session.put(f"a/{number % 50}", b"")

    flooding = network.thread(flood)
    programs = [
        network.program(
            """
            import threading
            from rosz.node import Context

            arrived = threading.Event()
            context = Context()
            for number in range(50):
                context.session.subscriber(f"a/{number}", lambda _: arrived.set(), rare=True)
                context.session.queue_subscriber(f"a/{number}", 10, lambda _: arrived.set())
            arrived.wait()
            """
        )
        for _ in range(repeats(4, 40))
    ]
    codes = [program.exit_code() for program in programs]
    ending.set()
    flooding.join()
    assert codes == [0] * len(programs)
    assert not [line for program in programs for line in program.lines]


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
