"""A system of twenty processes, of which each is killed in turn, and comes back."""

from __future__ import annotations

import time

from network import TIMEOUT, Network, Program, eventually

from rosz.graph import Graph

NODE = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String

    number, count = int(sys.argv[1]), int(sys.argv[2])
    with rosz.Node(f"n{number}") as node:
        node.params.set(f"/alive/n{number}", number)
        node.subscription(f"t{(number + 1) % count}", String, lambda m: print("heard", m.data))
        out = node.publisher(f"t{number}", String)
        print("up")
        for tick in node.rate(20):
            out.publish(f"{number}.{sys.argv[3]}")
"""
COUNT = 20
PATIENT = {"ZENOH_CONFIG_OVERRIDE": "transport/link/tx/lease=3600000"}
"""Nobody finds out that a process has ended by its silence."""


def start(network: Network, number: int, life: int) -> Program:
    return network.program(NODE, str(number), str(COUNT), str(life), **PATIENT)


def wait_until_gone(graph: Graph, name: str) -> float:
    """Return the time at which a node had left the graph."""
    graph.wait_for(lambda view: name not in view.nodes(), TIMEOUT, f"the end of {name}")
    return time.monotonic()


def wait_until_back(graph: Graph, name: str) -> None:
    """Wait until the observer, too, sees the next life of a node."""
    graph.wait_for(lambda view: name in view.nodes(), TIMEOUT, f"the next life of {name}")


def test_each_dies_and_comes_back(network: Network) -> None:
    """Nobody is special: whoever dies, all others go on, and its next life joins them."""
    programs = [start(network, number, 0) for number in range(COUNT)]
    for number, program in enumerate(programs):
        program.wait_for(f"heard {(number + 1) % COUNT}.0")
    patient = PATIENT["ZENOH_CONFIG_OVERRIDE"]
    observer = network.node("observer", context=network.context(zenoh_override=patient))
    graph = observer.context.graph
    names = {f"/n{number}" for number in range(COUNT)}
    graph.wait_for(lambda view: names <= set(view.nodes()), TIMEOUT, "all nodes")
    # The mesh is complete: the observer itself sees the end of each process.
    eventually(lambda: len(observer.context.session.links()) >= COUNT, "links to all")
    gone, back = [], []
    for number in range(COUNT):
        began = time.monotonic()
        programs[number].kill()
        name = f"/n{number}"
        rest = names - {name}
        gone.append(wait_until_gone(graph, name) - began)
        assert rest <= set(graph.view().nodes())
        began = time.monotonic()
        programs[number] = start(network, number, 1)
        before = (number - 1) % COUNT
        programs[before].wait_for(f"heard {number}.1")
        programs[number].wait_for(f"heard {(number + 1) % COUNT}.")
        back.append(time.monotonic() - began)
        wait_until_back(graph, name)
        assert len(observer.params.get("/alive")) == COUNT
    print(f"\nkill -9 to gone from the graph: {max(gone):.2f} s at most of {COUNT}")
    print(f"start of its next life to heard by a neighbour: {max(back):.2f} s at most")
    assert not [program for program in programs if "Traceback" in program.output]
