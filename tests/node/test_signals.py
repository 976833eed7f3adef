"""Ctrl-C and SIGTERM, in programs of all habits."""

from __future__ import annotations

import signal
import time

import pytest
from network import WITHOUT_LIMITS, Network, Program

from rosz.node import signals

POLITE = """
    import time
    import rosz

    def tell(_):
        while not node.context.cooperative:  # the main thread may be slow to get to its wait
            time.sleep(0.001)
        print("ready", flush=True)

    with rosz.Node("polite") as node:
        node.on_shutdown(lambda reason: print(f"hook: {{reason}}\\n", end="", flush=True))
        waiting = node.timer(0.05, tell, oneshot=True)
        {wait}
    print("done", flush=True)
"""

WAITS = {
    "spin": "node.spin()",
    "rate": "[print(end='') for tick in node.rate(50)]",
    "rate of one in 100 s": "[print(end='') for tick in node.rate(0.01)]",
    "sleep": "node.sleep(100)",
    "question": "exec('import time\\nwhile not node.is_shutdown: time.sleep(0.01)')",
    "iteration": (
        "from rosz.msgs.std_msgs.msg import String; [None for m in node.subscription('t', String)]"
    ),
    "context": "node.context.wait_for_shutdown()",
}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("wait", WAITS.values(), ids=WAITS)
def test_polite_programs_end_by_themselves(
    network: Network, wait: str, number: signal.Signals
) -> None:
    program = network.program(WITHOUT_LIMITS + POLITE.format(wait=wait))
    program.wait_for("ready")
    program.send(number)
    assert program.exit_code() == 0, program.output
    assert program.lines == ["ready", f"hook: {number.name}", "done"]


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGINT, -signal.SIGINT), (signal.SIGTERM, 128 + signal.SIGTERM)],
    ids=["SIGINT", "SIGTERM"],
)
def test_deaf_program_is_interrupted(network: Network, number: signal.Signals, code: int) -> None:
    """One that never asks gets an exception, and still runs its hooks."""
    program = network.program(
        """
        import time
        import rosz

        node = rosz.Node("deaf")
        node.on_shutdown(lambda reason: print(f"hook: {reason}\\n", end="", flush=True))
        try:
            print("ready", flush=True)
            while True:  # a signal right before one long sleep would be seen at its end
                time.sleep(0.01)
        except BaseException as error:
            print(type(error).__name__, flush=True)
            raise
        """
    )
    program.wait_for("ready")
    program.send(number)
    assert program.exit_code() == code, program.output
    assert f"hook: {number.name}" in program.output
    assert {"KeyboardInterrupt", "SystemExit"} & set(program.lines)


STUCK = """
    import time
    import rosz

    node = rosz.Node("stuck")
    node.on_shutdown(lambda reason: print(f"hook: {reason}\\n", end="", flush=True))
    node.is_shutdown
    node.timer(0.05, lambda _: print("ready", flush=True), oneshot=True)

    def stand_here():
        time.sleep(100)

    stand_here()
"""


def leave_at_second_signal(program: Program, number: signal.Signals) -> None:
    program.wait_for("ready")
    program.send(number)
    program.wait_for("hook")
    time.sleep(2 * signals._SAME_SIGNAL)  # as a person does who means it
    program.send(number)
    assert program.exit_code() == 128 + number, program.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_second_signal_dumps_stacks_and_leaves(network: Network, number: signal.Signals) -> None:
    program = network.program(STUCK)
    leave_at_second_signal(program, number)
    assert "in stand_here" in program.output


def test_second_signal_during_a_hook_that_hangs(network: Network) -> None:
    program = network.program(
        """
        import threading
        import rosz

        def hang_here(reason):
            print("hook", flush=True)
            threading.Event().wait()

        node = rosz.Node("hung")
        node.on_shutdown(hang_here)
        node.timer(0.05, lambda _: print("ready", flush=True), oneshot=True)
        node.spin()
        """
    )
    leave_at_second_signal(program, signal.SIGINT)
    assert "in hang_here" in program.output


def test_put_in_the_background_by_a_script(network: Network) -> None:
    """A shell that is not interactive starts background jobs with Ctrl-C ignored."""
    program = network.program(
        """
        import signal

        signal.signal(signal.SIGINT, signal.SIG_IGN)
        import rosz

        node = rosz.Node("background")
        node.timer(0.01, lambda _: print("ready", flush=True), oneshot=True)
        node.spin()
        print("done")
        """
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0, program.output
    assert program.lines == ["ready", "done"]


def test_own_handler_of_the_program_stays(network: Network) -> None:
    program = network.program(
        """
        import signal
        import rosz

        signal.signal(signal.SIGINT, lambda *_: print("mine", flush=True))
        node = rosz.Node("own")
        node.timer(0.05, lambda _: print("ready", flush=True), oneshot=True)
        node.spin()
        print("done", flush=True)
        """
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    program.wait_for("mine")
    program.send(signal.SIGTERM)
    assert program.exit_code() == 0
    assert program.lines[-1] == "done"


def test_several_nodes_and_contexts_end_together(network: Network) -> None:
    program = network.program(
        """
        import sys
        import rosz

        nodes = [rosz.Node(f"node{n}") for n in range(3)]
        for node in nodes:
            node.on_shutdown(lambda _, name=node.name: sys.stdout.write(name + "\\n"))
        nodes[0].timer(0.05, lambda _: print("ready", flush=True), oneshot=True)
        for node in nodes:
            node.spin()
        """
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert sorted(program.lines) == ["/node0", "/node1", "/node2", "ready"]


def test_after_the_end_signals_do_what_they_always_did(network: Network) -> None:
    """A program that has closed its nodes and goes on is an ordinary program."""
    program = network.program(
        """
        import time
        import rosz

        with rosz.Node("short") as node:
            node.is_shutdown
        try:
            print("ready", flush=True)
            while True:  # a signal right before one long sleep would be seen at its end
                time.sleep(0.01)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        with rosz.Node("again") as node:
            node.timer(0.05, lambda _: print("again", flush=True), oneshot=True)
            node.spin()
        print("deaf", flush=True)
        while True:
            time.sleep(0.01)
        """
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    program.wait_for("interrupted")
    program.wait_for("again")
    program.send(signal.SIGTERM)
    program.wait_for("deaf")
    program.send(signal.SIGTERM)
    assert program.exit_code() == 128 + signal.SIGTERM


ASYNCIO = """
    import asyncio
    import signal
    import rosz
    from rosz.msgs.std_msgs.msg import String

    async def main():
        loop = asyncio.get_running_loop()
        loop.add_signal_handler(signal.SIGUSR1, lambda: print("usr1", flush=True))
        with rosz.Node("loop") as node:
            node.on_shutdown(lambda reason: print("hook", flush=True))
            loop.call_later(0.05, lambda: print("ready", flush=True))
            async for message in node.subscription("t", String):
                print(message.data, flush=True)
        print("done", flush=True)

    asyncio.run(main())
"""


@pytest.mark.parametrize(
    ("number", "code", "last"),
    [(signal.SIGTERM, 0, "done"), (signal.SIGINT, -signal.SIGINT, "KeyboardInterrupt")],
    ids=["SIGTERM", "SIGINT"],
)
def test_asyncio_owns_the_main_thread(
    network: Network, number: signal.Signals, code: int, last: str
) -> None:
    """An event loop has the wake-up pipe; SIGINT is its own, SIGTERM is heard all the same."""
    program = network.program(ASYNCIO)
    program.wait_for("ready")
    program.send(signal.SIGUSR1)
    program.wait_for("usr1")
    program.send(number)
    assert program.exit_code() == code, program.output
    assert "hook" in program.lines
    assert program.lines[-1] == last


def test_node_off_the_main_thread(network: Network) -> None:
    """Signals are left alone if the node is not made in the main thread."""
    program = network.program(
        """
        import threading
        import rosz

        def run():
            with rosz.Node("guest") as node:
                node.timer(0.05, lambda _: print("ready", flush=True), oneshot=True)
                node.spin()
            print("guest is done", flush=True)

        guest = threading.Thread(target=run)
        guest.start()
        try:
            guest.join()
        except KeyboardInterrupt:
            print("mine", flush=True)
            import rosz.node
            raise SystemExit(5) from None
        """
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    program.wait_for("mine")
    program.kill()
