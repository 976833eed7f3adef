"""Clients that subscribe to the log are not flooded with what was logged before."""

from __future__ import annotations

from network import Network, eventually

from .bridge import bridge_on

NODES = 5
LINES = 40


def test_a_subscriber_of_logs_gets_no_history(network: Network) -> None:
    """rosout is latched for ROS 2: each node keeps what it logged."""
    nodes = [network.node(f"old{number}") for number in range(NODES)]
    for node in nodes:
        for number in range(LINES):
            node.log.info("before %d", number)
        node.log.flush()
    with bridge_on(network) as bridge, bridge.client() as client:
        graph = bridge.node.context.graph
        eventually(lambda: len(graph.view().publishers("/rosout")) > NODES, "the publishers")
        client.send("subscribe", topic="/rosout", type="rosgraph_msgs/Log")
        client.sync()
        texts: list[str] = []
        for node in nodes:
            view = node.context.graph.view
            eventually(lambda view=view: view().subscriptions("/rosout"), "the subscription")  # type: ignore[misc]
            node.log.info("after")
        while texts.count("after") < NODES:
            got = client.receive()
            if got["op"] == "publish":
                texts.append(got["msg"]["msg"])
        assert [text for text in texts if "before" in text] == []
