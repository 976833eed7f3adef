"""The parameters of nodes of ROS 2 beside those of the store, as one tree."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from interop.ros2_node import Ros2Node, ros2_node
from network import TIMEOUT, Network, eventually

from rosz.errors import NoReplica, ParamError, ParamNotFound, WaitTimeout
from rosz.introspect import ParameterTree
from rosz.node import Node
from rosz.params import DELETED, split
from rosz.session import Session
from rosz.wire import Kind, entities_key


@pytest.fixture
def keeper(network: Network) -> Node:
    """A rosz node, whose process keeps the store."""
    node = network.node("keeper")
    node.params["/keeper/rate"] = 1
    node.params["/talker"] = {"rate": 99, "beside": True}
    return node


@pytest.fixture
def talker(network: Network, keeper: Node) -> Iterator[Ros2Node]:  # noqa: ARG001  # there before
    values = {"rate": 10.0, "gains__p": 1, "gains__names": ["x"], "use_sim_time": False}
    with ros2_node(network.rendezvous, network.domain, "talker", **values) as node:
        node.values["qos_overrides./parameter_events.publisher.depth"] = node.values["gains.p"]
        node.read_only.add("qos_overrides./parameter_events.publisher.depth")
        yield node


class Tree(ParameterTree):
    """One with the warnings that it gave."""

    def __init__(self, session: Session, domain: int) -> None:
        self.warnings: list[str] = []
        super().__init__(session, domain, self.warnings.append, timeout=TIMEOUT)


def await_node(session: Session, domain: int, name: str) -> Session:
    """Wait until a session sees the node that has just started, and return the session."""
    key = entities_key(domain, Kind.SERVICE, f"{name}/get_parameters")
    eventually(lambda: session.live_tokens(key, TIMEOUT), f"{name} is there")
    return session


@pytest.fixture
def tree(network: Network, talker: Ros2Node) -> Tree:  # noqa: ARG001  # there before
    return Tree(await_node(network.session(), network.domain, "/talker"), network.domain)


def test_names(tree: Tree) -> None:
    assert tree.names() == [
        "/keeper/rate",
        "/talker/beside",
        "/talker/gains/names",
        "/talker/gains/p",
        "/talker/qos_overrides/parameter_events/publisher/depth",
        "/talker/rate",
        "/talker/use_sim_time",
    ]
    assert tree.warnings == []


def test_get(tree: Tree) -> None:
    """A node's own values come before what the store has below its name."""
    assert tree.get("/talker/rate") == 10.0
    assert tree.get("/talker/gains") == {"p": 1, "names": ["x"]}
    everything = tree.get("/")
    assert everything["keeper"] == {"rate": 1}
    assert everything["talker"] == tree.get("/talker")
    assert everything["talker"] == {
        "rate": 10.0,
        "beside": True,
        "gains": {"p": 1, "names": ["x"]},
        "use_sim_time": False,
        "qos_overrides": {"parameter_events": {"publisher": {"depth": 1}}},
    }
    assert tree.get("/talker/beside") is True
    with pytest.raises(ParamNotFound, match="'/talker/rat' is not set; did you mean"):
        tree.get("/talker/rat")


def test_write(tree: Tree, talker: Ros2Node, keeper: Node) -> None:
    """Each part goes where it belongs; a whole number becomes the float that the node has."""
    tree.write(
        [
            (split("/talker/rate"), 5),
            (split("/talker/gains"), {"p": 2, "names": []}),
            (split("/keeper/rate"), 2),
        ]
    )
    assert (talker.get("rate"), talker.get("gains.p"), talker.get("gains.names")) == (5.0, 2, [])
    assert talker.calls.count("set_parameters_atomically") == 1
    assert keeper.params["/keeper/rate"] == 2
    assert keeper.context.params.get("/talker/rate") == 99


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("rate", "fast", "refuses to set '/talker/rate': Wrong parameter type"),
        ("new", 1, "'/talker/new': parameter 'new' cannot be set because it was not declared"),
        ("rate", [1, "x"], r"'/talker/rate' cannot be the list \[1, 'x'\] in ROS 2"),
        ("gains", {"p": 2, "q": 3}, "'/talker/gains/p', '/talker/gains/q': parameter 'gains.q'"),
    ],
)
def test_refusals(tree: Tree, talker: Ros2Node, name: str, value: object, reason: str) -> None:
    before = dict(talker.values)
    with pytest.raises(ParamError, match=reason):
        tree.write([(split(f"/talker/{name}"), value)])
    assert talker.values == before


def test_what_was_read_can_be_written(tree: Tree, talker: Ros2Node) -> None:
    """What is read-only is not set to the value that it has."""
    value = tree.get("/talker")
    del value["beside"]
    talker.values["rate"].double_value = 1.0
    tree.write([(split("/talker"), value)])
    assert talker.get("rate") == 10.0
    value["qos_overrides"]["parameter_events"]["publisher"]["depth"] = 3
    with pytest.raises(ParamError, match="because it is read-only"):
        tree.write([(split("/talker"), value)])


def test_delete(tree: Tree, talker: Ros2Node) -> None:
    with pytest.raises(ParamError, match=r"is of type \{double\}, setting it to \{not set\}"):
        tree.delete("/talker/rate")
    with pytest.raises(ParamNotFound):
        tree.write([(split("/talker/none"), DELETED)])
    assert talker.get("rate") == 10.0


def test_a_parameter_beside_others_below_it(tree: Tree, talker: Ros2Node) -> None:
    talker.values["gains"] = talker.values["gains.p"]
    assert tree.get("/talker/gains") == 1
    value = tree.get("/talker")
    assert (value["gains"], value["gains.p"]) == (1, 1)
    tree.write([(split("/talker"), {"gains": 5, "gains.p": 6})])
    assert (talker.get("gains"), talker.get("gains.p")) == (5, 6)


def test_a_node_that_does_not_answer(network: Network, talker: Ros2Node) -> None:
    """Lists lack what it has, and say so; who asks for it alone gets the error."""
    session = await_node(network.session(), network.domain, "/talker")
    tree = Tree(session, network.domain)
    tree._timeout = 0.3  # for nodes; the store has as long as it needs
    talker.answering.clear()
    assert tree.get("/keeper/rate") == 1
    assert tree.names() == ["/keeper/rate", "/talker/beside", "/talker/rate"]
    (warning,) = tree.warnings
    assert warning == (
        "the parameters of /talker are missing here: no answer of node '/talker' for its parameters"
        " within 0.3 s; it hangs, or nobody spins it"
    )
    with pytest.raises(WaitTimeout, match="node '/talker'"):
        tree.get("/talker/rate")
    with pytest.raises(WaitTimeout, match="node '/talker'"):
        tree.write([(split("/talker/rate"), 1)])


def test_nodes_of_ros2_alone(network: Network) -> None:
    """They need no replica of the store, which nobody has."""
    session = network.session()
    with ros2_node(network.rendezvous, network.domain, "alone", speed=1.5) as node:
        tree = Tree(await_node(session, network.domain, "/alone"), network.domain)
        assert tree.get("/") == {"alone": {"speed": 1.5}}
        assert tree.names() == ["/alone/speed"]
        tree.write([(split("/alone/speed"), 2)])
        assert node.get("speed") == 2.0
        with pytest.raises(NoReplica):
            tree.write([(split("/other"), 2)])
    key = entities_key(network.domain, Kind.SERVICE, "/alone/get_parameters")
    eventually(lambda: not session.live_tokens(key, TIMEOUT), "it is gone")
    with pytest.raises(NoReplica):
        Tree(session, network.domain).names()
