"""Ctrl-C in the first moments of a node: it waits until the session is open, then ends it."""

from __future__ import annotations

import signal

import pytest
from network import Network, Program

INTERRUPTED = """
    import os
    import signal
    import sys

    def interrupt():
        os.kill(os.getpid(), signal.SIGINT)

    class Importing:  # Ctrl-C as a module is imported
        def find_spec(self, name, path, target=None):
            if name == {module!r}:
                interrupt()

    sys.meta_path.insert(0, Importing())
    import rosz

    def opening():  # Ctrl-C as a session opens
        from rosz.session import Session
        real = Session.open

        def open(config, peers):
            interrupt()
            session = real(config, peers)
            print("opened", flush=True)
            return session

        Session.open = open
"""
MAKE = """
    try:
        node = rosz.Node("early")
        print("not interrupted", flush=True)
    finally:
        print("cleaned up", flush=True)
"""


@pytest.mark.parametrize("module", ["rosz.session", "rosz.params.wire", "rosz.node.signals"])
def test_while_modules_are_imported(network: Network, module: str) -> None:
    """An exception there may crash msgspec."""
    program = network.program(INTERRUPTED.format(module=module) + MAKE)
    assert program.exit_code() == -signal.SIGINT, program.output
    assert program.lines == ["cleaned up"]


def test_while_the_session_opens(network: Network) -> None:
    program = network.program(INTERRUPTED.format(module="") + "    opening()" + MAKE)
    assert program.exit_code() == -signal.SIGINT, program.output
    assert program.lines == ["opened", "cleaned up"]


def test_with_a_context(network: Network) -> None:
    program = network.program(
        INTERRUPTED.format(module="")
        + """
    opening()
    try:
        context = rosz.Context()
    except KeyboardInterrupt:
        print("mine", flush=True)
    """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["opened", "mine"]


def test_put_in_the_background_by_a_script(network: Network) -> None:
    """There Ctrl-C is ignored until the node has taken it."""
    ignored = "    signal.signal(signal.SIGINT, signal.SIG_IGN)\n    opening()"
    program = network.program(INTERRUPTED.format(module="") + ignored + MAKE)
    assert program.exit_code() == -signal.SIGINT, program.output
    assert program.lines == ["opened", "cleaned up"]


def test_twice(network: Network) -> None:
    """The second one ends the process at once."""
    program = network.program(
        INTERRUPTED.format(module="")
        + """
    import rosz.interrupts
    rosz.interrupts._SAME_SIGNAL = 0
    real_interrupt = interrupt
    interrupt = lambda: [real_interrupt() for _ in range(2)]
    opening()
    """
        + MAKE
    )
    assert program.exit_code() == 128 + signal.SIGINT, program.output
    assert program.lines == []


def test_the_program_has_a_handler(network: Network) -> None:
    program = network.program(
        INTERRUPTED.format(module="")
        + """
    signal.signal(signal.SIGINT, lambda *_: print("mine", flush=True))
    opening()
    """
        + MAKE
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["mine", "opened", "not interrupted", "cleaned up"]


INTERACTIVE = """
import time
import rosz
node = rosz.Node('typed')
print('ready', flush=True)
while True: time.sleep(0.01)  # in one long sleep, a signal right before it would be seen at its end
"""


def _interactive(network: Network) -> Program:
    program = network.run("-i", "-c", INTERACTIVE)
    program.wait_for("ready")
    program.send(signal.SIGINT)
    program.wait_for("KeyboardInterrupt")
    return program


def test_interactive_interpreter(network: Network) -> None:
    """Ctrl-C ends what was typed, not the node, and as often as one likes."""
    program = _interactive(network)
    program.say("print('waiting', flush=True); node.spin()")
    program.wait_for("waiting")
    program.send(signal.SIGINT)
    program.wait_for("KeyboardInterrupt", times=2)
    program.say("print('shut down:', node.is_shutdown, flush=True)")
    program.wait_for("shut down: False")
    program.say("exit(3)")
    assert program.exit_code() == 3, program.output


def test_interactive_interpreter_is_terminated(network: Network) -> None:
    program = _interactive(network)
    program.say("node.on_shutdown(lambda reason: print(f'hook: {reason}', flush=True))")
    program.say("print('again', flush=True); [time.sleep(0.01) for _ in iter(int, 1)]")
    program.wait_for("again")
    program.send(signal.SIGTERM)
    program.wait_for("hook: SIGTERM")
    assert program.exit_code() == 128 + signal.SIGTERM, program.output
