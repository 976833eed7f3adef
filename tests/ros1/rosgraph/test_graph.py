"""rosgraph.impl.graph and the module ``ros``."""

from __future__ import annotations

import pytest
from network import Network
from oracle import same

from rosz.msgs.std_msgs.msg import String
from rosz.node import Node

_EDGES = """
from rosgraph.impl import graph
edges = graph.EdgeList()
result = [edges.add(graph.Edge("a", "b", "l")), edges.add(graph.Edge("a", "b", "l")),
          edges.add_edges("c", "a", "b", "m"), edges.add_edges("c", "a", "b", "m"),
          edges.add_edges("", "a", "o"), sorted(str(one) for one in edges),
          edges.has(graph.Edge("a", "c", "m")), graph.Edge("x", "y", "z").rkey,
          graph.edge_args("a", "b", "b", "l"), graph.node_topic(graph.topic_node("/t"))]
edges.delete(graph.Edge("a", "b", "l"))
result.append(sorted(str(one) for one in edges))
edges.delete_all("c")
result.append(len(list(edges)))
"""


@pytest.mark.ros1
def test_edges_are_those_of_rosgraph() -> None:
    same(_EDGES, "rosgraph.impl.graph", "python3-rosgraph")


@pytest.fixture
def nodes(network: Network) -> list[Node]:
    """A talker with a listener, and one without."""
    talker, listener = network.node("talker"), network.node("listener")
    talker.publisher("chatter", String)
    talker.publisher("lonely", String)
    listener.subscription("chatter", String, lambda _: None)
    return [talker, listener]


@pytest.mark.usefixtures("nodes")
def test_graph_and_module_ros(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        from ros import rosgraph, rosnode
        from rosgraph.impl.graph import Graph
        graph = Graph()
        assert graph.update() and not graph.update()
        print(sorted(graph.nn_nodes), [str(one) for one in graph.nn_edges])
        print(sorted(str(one) for one in graph.nt_edges if "rosout" not in str(one)))
        print(any("lonely" in str(one) for one in graph.nt_all_edges), rosnode.NAME)
        try:
            from ros import no_such_module
        except ImportError as error:
            print(error)
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines[:3] == [
        "['/listener', '/talker'] ['/talker->/listener']",
        "[' /chatter->/listener', '/talker-> /chatter']",
        "True rosnode",
    ]
    assert "no_such_module" in program.lines[3]


def test_a_module_named_ros_of_the_program_comes_first(network: Network) -> None:
    (network.folder / "ros.py").write_text("WHO = 'own'\n")
    script = network.folder / "main.py"
    script.write_text("import ros\nprint(ros.WHO)\n")
    program = network.program(
        f"import sys; from rosz.ros1.__main__ import main; main([{str(script)!r}])"
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["own"]
