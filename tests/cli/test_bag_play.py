from __future__ import annotations

from pathlib import Path
from queue import SimpleQueue

from network import TIMEOUT, Network

import rosz.bags
from rosz.msgs.rcl_interfaces.msg import ParameterEvent
from rosz.msgs.std_msgs.msg import String
from rosz.qos import QoS

from .shell import Shell

SECOND = 1_000_000_000


def test_waiting_for_subscribers(shell: Shell, network: Network, tmp_path: Path) -> None:
    """Nobody has to subscribe to what each node of ROS 2 publishes for tools."""
    path = tmp_path / "a.mcap"
    with rosz.bags.open(path, "w") as bag:
        bag.write("/parameter_events", ParameterEvent(node="/there"), SECOND)
        bag.write("/text", String("hello"), 2 * SECOND)
    play = shell.start("bag", "play", "-i", "--wait-for-subscribers", "-p", "robot", str(path))
    listener = network.node("listener")
    listener.context.graph.wait_for_topic("/robot/text", TIMEOUT)
    assert "Done." not in "".join(play.lines)  # it waits for the other topic
    texts: SimpleQueue[String] = SimpleQueue()
    listener.subscription("/robot/text", String, texts.put, qos=QoS(depth=1))
    assert texts.get(timeout=TIMEOUT).data == "hello"
    assert play.exit_code() == 0
