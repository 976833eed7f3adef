"""Processes that are stopped, as by Ctrl-Z: nobody else waits for them, and they come back."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from network import Network, Program, free_port

OLD = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Empty

    name = sys.argv[1]
    with rosz.Node(name) as node:
        node.params.set(f"/from/{name}", 1)
        node.service(f"/reset_{name}", Empty, lambda _: Empty.Response())
        out = node.publisher(f"/out_{name}", String)
        node.subscription("/to_all", String, lambda m: print("heard", m.data))
        node.subscription("/burst", String, lambda m: print("burst", len(m.data)))
        node.params.watch("/new", lambda *_: print("param"))
        print("up")
        for tick in node.rate(20):
            out.publish(name)
"""
NEW = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String

    name = sys.argv[1]
    with rosz.Node(name) as node:
        node.subscription("/to_all", String, lambda m: print("heard", m.data))
        for other in ("a", "b"):
            node.subscription(f"/out_{other}", String, lambda m: print("heard", m.data))
        out = node.publisher("/to_all", String)
        node.params.set(f"/new/{name}", 1)
        for tick in node.rate(20):
            out.publish(name)
"""
SLOW = """
    import time
    from rosz.session import opening

    connect = opening.connect_to_running

    def connect_late(*arguments):
        print("registered")
        time.sleep(12)
        connect(*arguments)

    opening.connect_to_running = connect_late
"""
PASSING = """
    import rosz
    from rosz.msgs.std_msgs.msg import String

    with rosz.Node("passing") as node:
        node.publisher("/to_all", String).publish("passing")
        print("param", node.params.get("/from/b"))
"""
BURST = """
    import rosz
    from rosz.msgs.std_msgs.msg import String

    with rosz.Node("burst") as node:
        out = node.publisher("/burst", String)
        out.wait_for_subscribers(2, 60)
        print("up")
        input()
        for _ in range(30):
            out.publish("x" * 1_000_000)
"""
FLOOD = """
    import queue
    import time
    import rosz
    from rosz.msgs.std_msgs.msg import String

    arrivals = queue.SimpleQueue()
    with rosz.Node("flood") as node:
        node.subscription("/out_a", String, lambda _: arrivals.put(time.monotonic()))
        out = node.publisher("/burst", String)
        out.wait_for_subscribers(2, 60)
        print("up")
        input()
        graph = node.context.graph
        while "/b" in graph.view().nodes():
            out.publish("x" * 20_000)
            time.sleep(0.01)  # the rate at which it publishes
        times = [arrivals.get() for _ in range(arrivals.qsize() + 10)]
    print("took", max(after - before for before, after in zip(times, times[1:])))
"""
CALLER = """
    import rosz
    from rosz.errors import WaitTimeout
    from rosz.msgs.std_srvs.srv import Empty

    with rosz.Node("caller") as node:
        reset = node.client("/reset_b", Empty)
        reset.wait_for_service()
        print("up")
        input()
        try:
            reset(timeout=0.5)
        except WaitTimeout as error:
            print("WaitTimeout", error)
"""
_HOUR = "3600000"
PATIENT = {
    "ZENOH_CONFIG_OVERRIDE": (
        f"transport/link/tx/lease={_HOUR};transport/unicast/open_timeout={_HOUR}"
    )
}
"""Whoever waits for a process that is stopped waits for longer than the test."""
GIVEN_UP = {"ZENOH_CONFIG_OVERRIDE": "transport/link/tx/lease=5000"}
AT_ONCE = 8.0
"""Seconds: much more than the thirtieth part that it takes, and less than the 10 s for which the
system may go on to deliver what was sent by a link that is closed."""


@pytest.fixture(params=["unix", "tcp"])
def network(request: pytest.FixtureRequest) -> Iterator[Network]:
    """A network that meets at a unix socket, or at a port."""
    made = Network()
    if request.param == "tcp":
        made.rendezvous = f"tcp/localhost:{free_port()}"
    yield made
    made.close()


def old(network: Network, name: str, **variables: str) -> Program:
    program = network.program(OLD, name, **variables)
    program.wait_for("up")
    return program


def core(network: Network) -> Program:
    program = network.run("-m", "rosz", "core")
    program.wait_for("listening")
    return program


def rosz(network: Network, *words: str, **variables: str) -> tuple[int, str]:
    """Return the exit code and the output of a command."""
    program = network.run("-m", "rosz", *words, **variables)
    return program.exit_code(), program.output


@pytest.mark.parametrize("stopped", ["core", "first", "other"])
def test_nobody_else_waits(network: Network, stopped: str) -> None:
    """Those that are awake find each other, and newcomers find them, whoever is stopped."""
    held = [core(network)] if stopped == "core" else []
    programs = {name: old(network, name, **PATIENT) for name in ("a", "b", "c")}
    victim = held[0] if held else programs["a" if stopped == "first" else "c"]
    victim.send(signal.SIGSTOP)
    passing = network.program(PASSING, **PATIENT)
    programs["b"].wait_for("heard passing")
    assert passing.exit_code() == 0, passing.output
    assert "param 1" in passing.output
    for words, answer in (
        (("topic", "list"), "/out_b"),
        (("node", "info", "/b"), "/reset_b"),
        (("topic", "echo", "-n", "1", "/out_b"), "data: "),
        (("param", "get", "/from/b"), "1"),
        (("service", "call", "/reset_b"), ""),
    ):
        code, output = rosz(network, *words, **PATIENT)
        assert code == 0, output
        assert answer in output
    newcomers = [network.program(NEW, name, **PATIENT) for name in ("n", "m")]
    newcomers[0].wait_for("heard m")
    newcomers[1].wait_for("heard b")
    victim.send(signal.SIGCONT)
    if not held:
        for name in ("n", "m"):
            victim.wait_for(f"heard {name}")
        victim.wait_for("param")
    if stopped == "first":
        newcomers[0].wait_for("heard a")


def test_who_must_wait_for_it_names_it(network: Network) -> None:
    old(network, "a")
    victim = old(network, "b")
    caller = network.program(CALLER)
    caller.wait_for("up")
    victim.send(signal.SIGSTOP)
    caller.say("")
    assert f"(pid {victim.pid}) is stopped: let it go on" in caller.wait_for("WaitTimeout")
    code, output = rosz(network, "service", "call", "--timeout", "0.5", "/reset_b")
    assert code == 2
    assert f"(pid {victim.pid}) is stopped: let it go on" in output.splitlines()[0]
    waiting = network.run("-m", "rosz", "service", "call", "/reset_b")
    waiting.wait_for(f"(pid {victim.pid}) is stopped")
    victim.send(signal.SIGCONT)
    assert waiting.exit_code() == 0


def test_who_is_given_up_holds_up_nobody(network: Network) -> None:
    """With its link go samples that it never took: nobody waits for the system to deliver them."""
    _, victim = (old(network, name, **GIVEN_UP) for name in ("a", "b"))
    flood = network.program(FLOOD, **GIVEN_UP)
    flood.wait_for("up")
    victim.send(signal.SIGSTOP)
    flood.say("")
    assert flood.exit_code() == 0, flood.output
    assert float(flood.wait_for("took").split()[-1]) < AT_ONCE


def test_the_only_other_one_is_stopped(network: Network) -> None:
    """Who needs it says which it is; who does not goes on, and meets it when it goes on."""
    victim = old(network, "a")
    victim.send(signal.SIGSTOP)
    for words in (("topic", "list"), ("topic", "echo", "/out_a"), ("param", "get", "/from/a")):
        code, output = rosz(network, *words)
        assert code == 1
        assert f"(pid {victim.pid}) holds the meeting point" in output
        assert f"kill -CONT {victim.pid}" in output
    one, other = (network.program(NEW, name) for name in ("n", "m"))
    one.wait_for(f"(pid {victim.pid}) holds the meeting point")
    one.wait_for("heard m")
    other.wait_for("heard n")
    victim.send(signal.SIGCONT)
    victim.wait_for("heard n")
    victim.wait_for("heard m")
    one.wait_for("heard a")
    code, output = rosz(network, "node", "list")
    assert output.split() == ["/a", "/m", "/n"]


def test_one_that_opens_slowly_is_met_soon(network: Network) -> None:
    """On a busy machine it listens long after the other one has found out that it will."""
    victim = old(network, "a")
    victim.send(signal.SIGSTOP)
    slow = network.program(SLOW + NEW, "m")
    slow.wait_for("registered")
    other = network.program(NEW, "n")
    other.wait_for("heard m")
    slow.wait_for("heard n")


@pytest.mark.parametrize("first", ["victim", "publisher"])
def test_what_is_queued_for_it_holds_up_no_end(network: Network, first: str) -> None:
    awake = old(network, "b", **PATIENT)
    if first == "victim":
        victim = old(network, "a", **PATIENT)
    burst = network.program(BURST, **PATIENT)
    if first == "publisher":
        victim = old(network, "a", **PATIENT)
    burst.wait_for("up")
    victim.send(signal.SIGSTOP)
    burst.say("")
    assert burst.exit_code() == 0, burst.output
    assert "Traceback" not in burst.output
    awake.wait_for("burst 1000000")
