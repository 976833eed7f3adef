"""A forked child cannot use the nodes of its parent, gets an error at once, and harms nothing."""

from __future__ import annotations

import os
import re
import signal

import pytest
from network import Network

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")

PARENT = """
    import os
    import rosz
    from rosz.errors import ClosedError
    from rosz.msgs.example_interfaces.srv import AddTwoInts
    from rosz.msgs.std_msgs.msg import String

    node = rosz.Node("parent")
    publisher = node.publisher("chatter", String)
    latched = node.publisher("latched", String, latch=True)
    subscription = node.subscription("chatter", String)
    generic = node.subscription("chatter")
    node.subscription("chatter", String, lambda m: None)
    node.service("add", AddTwoInts, lambda request: request.a + request.b)
    client = node.client("add", AddTwoInts)
    assert client(1, 2).sum == 3

    CALLS = {
        "publish": lambda: publisher.publish("x"),
        "latched": lambda: latched.publish("x"),
        "get": lambda: subscription.get(1),
        "generic": lambda: generic.get(1),
        "call": lambda: client(1, 2),
        "wait": lambda: client.wait_for_service(1),
        "declare": lambda: node.publisher("new", String),
        "listen": lambda: node.subscription("new", String, print),
        "serve": lambda: node.service("new", AddTwoInts, print),
        "set": lambda: node.params.set("/x", 1),
        "graph": lambda: node.context.graph.wait_for_node("/x", 1),
    }

    def attempt():
        for name, call in CALLS.items():
            try:
                call()
            except ClosedError:
                print(name, "refused", flush=True)
            except BaseException as error:
                print(name, "failed:", type(error).__name__, error, flush=True)
            else:
                print(name, "went through", flush=True)
        generic.close()
        node.close()
        node.context.close()
"""
NAMES = (
    "publish",
    "latched",
    "get",
    "generic",
    "call",
    "wait",
    "declare",
    "listen",
    "serve",
    "set",
    "graph",
)


def test_everything_is_refused(network: Network) -> None:
    """With `os.fork`; the parent goes on as if nothing had been."""
    program = network.program(
        PARENT
        + """
    child = os.fork()
    if not child:
        attempt()
        raise SystemExit(0)
    assert os.waitpid(child, 0)[1] == 0, "the child failed"
    publisher.publish("after")
    assert subscription.get().data == "after"
    assert client(2, 2).sum == 4
    print("parent goes on", flush=True)
    """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == [*(f"{name} refused" for name in NAMES), "parent goes on"]


def test_what_it_is_told(network: Network) -> None:
    program = network.program(
        PARENT
        + """
    if not os.fork():
        publisher.publish("x")
    os.wait()
    """
    )
    assert program.exit_code() == 0, program.output
    told = program.wait_for("rosz.errors.ClosedError")
    assert "forked from one that uses rosz" in told
    assert "start the child first, or use the 'spawn' method of multiprocessing" in told


def test_contexts_do_not_add_up(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """A function that is registered for forks cannot be unregistered."""
    registered: list[object] = []
    monkeypatch.setattr(os, "register_at_fork", lambda **after: registered.append(after))
    for _ in range(2):
        network.context().close()
    assert registered == []


def test_multiprocessing(network: Network) -> None:
    """A child that does not use rosz works and ends as usual; so does one that is spawned."""
    program = network.program(
        PARENT
        + """
    import multiprocessing
    with multiprocessing.get_context("fork").Pool(2) as pool:
        print(pool.map(abs, [-1, -2]), flush=True)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        print(pool.map(abs, [-3]), flush=True)
    assert client(2, 2).sum == 4
    """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["[1, 2]", "[3]"]


def test_a_child_with_a_node_of_its_own(network: Network) -> None:
    """Forked first, then rosz in both: that works."""
    program = network.program(
        """
        import os
        child = os.fork()
        import rosz
        from rosz.msgs.std_msgs.msg import String
        if child:
            with rosz.Node("parent") as node:
                print("heard", node.subscription("chatter", String).get(50).data, flush=True)
            assert os.waitpid(child, 0)[1] == 0
        else:
            with rosz.Node("child") as node:
                publisher = node.publisher("chatter", String)
                publisher.wait_for_subscribers(timeout=50)
                publisher.publish("hello")
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["heard hello"]


REFUSED = "cannot open a session: .*forked from one that uses rosz.*'spawn'"
PARENTS = {
    "open": 'node = rosz.Node("parent")',
    "closed": 'with rosz.Node("parent"): pass',
}
POOLS = {
    "multiprocessing": "multiprocessing.get_context('fork').Pool(2)",
    "concurrent.futures": (
        "concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context('fork'))"
    ),
}


@pytest.mark.parametrize("parent", PARENTS.values(), ids=PARENTS)
def test_a_node_in_a_child_of_a_process_with_a_session(network: Network, parent: str) -> None:
    """Zenoh's threads are not in the child, so a session would never open there."""
    program = network.program(
        f"""
        import os
        import rosz
        {parent}
        if not os.fork():
            try:
                rosz.Node("child")
            except rosz.RoszError as error:
                print(error, flush=True)
            raise SystemExit(0)
        assert os.wait()[1] == 0
        with rosz.Node("again"):
            print("parent goes on", flush=True)
        """
    )
    assert program.exit_code() == 0, program.output
    refused, last = program.lines
    assert re.match(REFUSED, refused)
    assert last == "parent goes on"


@pytest.mark.parametrize("pool", POOLS.values(), ids=POOLS)
def test_a_node_in_a_worker_of_a_pool(network: Network, pool: str) -> None:
    program = network.program(
        f"""
        import concurrent.futures
        import multiprocessing
        import rosz

        def work(number):
            with rosz.Node(f"child{{number}}") as node:
                return node.name

        with {pool} as workers:
            print(*workers.map(work, [1, 2]), flush=True)
        node = rosz.Node("parent")
        with {pool} as workers:
            try:
                print(*workers.map(work, [3]), flush=True)
            except rosz.RoszError as error:
                print(error, flush=True)
        """
    )
    assert program.exit_code() == 0, program.output
    worked, refused = program.lines
    assert worked == "/child1 /child2"
    assert re.match(REFUSED, refused)


def test_a_child_that_is_terminated_at_its_beginning(network: Network) -> None:
    """As pools do it; it must not call the handler that it inherits, which ends the parent."""
    program = network.program(
        """
        import os
        import signal
        os.register_at_fork(after_in_child=lambda: os.kill(os.getpid(), signal.SIGTERM))
        import rosz
        node = rosz.Node("parent")
        child = os.fork()
        if not child:
            os._exit(0)
        print("child:", os.waitpid(child, 0)[1], flush=True)
        print("parent is shut down:", node.is_shutdown, flush=True)
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == [f"child: {signal.SIGTERM:d}", "parent is shut down: False"]


def test_the_end_of_a_child_waits_for_no_thread_of_the_parent(network: Network) -> None:
    program = network.program(
        """
        import os
        import rosz
        from rosz.session.at_exit import wait_for_calls

        with rosz.Node("parent"):
            child = os.fork()
            if not child:
                print("waits for nothing:", wait_for_calls(0.0), flush=True)
                os._exit(0)
            os.waitpid(child, 0)
        """
    )
    assert program.exit_code() == 0
    assert "waits for nothing: True" in program.lines
