"""Programs end, whether they close what they opened or not."""

from __future__ import annotations

import pytest
from network import TIMEOUT, WITHOUT_LIMITS, Network, repeats

from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.std_msgs.msg import String

AT_THE_END = """
    import atexit
    import rosz
    from rosz.msgs.example_interfaces.srv import AddTwoInts

    node = rosz.Node("polite", anonymous=True)
    client = node.client("add", AddTwoInts)
    client.wait_for_service()
    atexit.register(lambda: print("sum", client(1, 2).sum))
"""
EVERYTHING = """
    import threading
    import rosz
    from rosz.msgs.example_interfaces.srv import AddTwoInts
    from rosz.msgs.std_msgs.msg import String

    node = rosz.Node("forgetful", anonymous=True)
    other = rosz.Node("other", anonymous=True)
    latched = node.publisher("latched", String, latch=True)
    latched.publish("still here")
    publisher = node.publisher("chatter", String, queue_size=0)
    publisher.on_connection(lambda link: link.publish(String("hello")))
    got = threading.Event()
    node.subscription("chatter", String, lambda m: got.set())
    other.subscription("latched", String, lambda m: got.set())
    node.subscription("anything", None, print)
    waiting = node.subscription("never", String)
    threading.Thread(target=lambda: list(waiting), daemon=True).start()
    node.service("add", AddTwoInts, lambda request: request.a + request.b)
    client = other.client("add", AddTwoInts)
    client.wait_for_service()
    assert client(1, 2).sum == 3
    node.timer(0.001, lambda event: publisher.publish("tick"))
    node.log.info("all declared")
    node.params["/forgotten"] = 1
    assert got.wait(100)
    print("ended", flush=True)
"""
CYCLES = """
    import gc
    import os
    import sys
    import threading
    import time
    from rosz.environment import Environment
    from rosz.msgs.example_interfaces.srv import AddTwoInts
    from rosz.msgs.std_msgs.msg import String
    from rosz.node import Context, Node
    from rosz.qos import LATCHED

    def cycle(number):
        with Context(Environment.read()) as all, Node(f"n{number % 3}", context=all) as node:
            node.publisher("chatter", String).publish("hello")
            node.publisher("latched", String, qos=LATCHED).publish("hello")
            node.subscription("chatter", String, lambda _: None)
            node.service("add", AddTwoInts, lambda _: 0)
            node.client("add", AddTwoInts)
            node.timer(0.001, lambda _: None)

    def wait_for(what, count, most):
        while count() > most:
            print("more than", most, what, count(), flush=True)
            time.sleep(0.1)

    def open_files():
        return len(os.listdir("/proc/self/fd"))

    before = threading.active_count()
    for number in range(5):
        cycle(number)
    wait_for("threads", threading.active_count, before + 2)
    threads, files = threading.active_count(), open_files()
    for number in range(int(sys.argv[1])):
        cycle(number)
    wait_for("threads", threading.active_count, threads + 2)
    gc.collect()
    wait_for("files", open_files, files + 8)
"""


@pytest.mark.parametrize("company", [False, True], ids=["alone", "in company"])
def test_a_program_that_closes_nothing_ends_at_once(network: Network, company: bool) -> None:
    if company:
        network.node("neighbour").subscription("chatter", String, lambda _: None)
    for _ in range(repeats(3, 100)):
        program = network.program(WITHOUT_LIMITS + EVERYTHING)
        assert program.exit_code() == 0, program.output
        program.wait_for("ended")
        assert "Traceback" not in program.output
        program.close()


def test_an_exception_ends_it_too(network: Network) -> None:
    program = network.program(
        """
        import rosz

        node = rosz.Node("failing")
        node.timer(0.01, print)
        raise ValueError("no more")
        """
    )
    assert program.exit_code() == 1
    assert program.lines[-1] == "ValueError: no more"


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("company", [False, True], ids=["alone", "in company"])
def test_start_and_stop(network: Network, company: bool) -> None:
    """Cycles of everything leave no thread, no file and no memory to speak of behind."""
    if company:
        network.node("neighbour").subscription("chatter", String, lambda _: None)
    program = network.program(CYCLES, str(repeats(15, 500)))
    assert program.exit_code(repeats(4, 20) * TIMEOUT) == 0, program.output


def test_a_call_at_the_exit(network: Network) -> None:
    """No thread starts there any more with Python 3.12."""
    network.node("server").service("add", AddTwoInts, lambda request: request.a + request.b)
    program = network.program(AT_THE_END)
    assert program.exit_code() == 0
    assert program.lines == ["sum 3"]


def test_programs_that_end_at_once(network: Network) -> None:
    network.node("other").client("add", AddTwoInts)
    for _ in range(repeats(5, 100)):
        program = network.program("import rosz; rosz.Node('brief')")
        assert program.exit_code() == 0
        assert program.lines == []
