"""Recorders that start at once on a busy machine say what they could not follow yet."""

from __future__ import annotations

import re
import signal

import pytest
from network import TIMEOUT, Network, eventually

from rosz.bags import open_reader

pytestmark = [pytest.mark.system]
RECORDERS = 6
TOPICS = 11
TALKER = f"""
    import itertools
    import sys
    from rosz.msgs.std_msgs.msg import Int32
    from rosz.node import Node
    with Node("talker") as node:
        publishers = [node.publisher(f"/t{{number}}", Int32) for number in range({TOPICS})]
        print("ready")
        for count in itertools.count():
            for publisher in publishers:
                publisher.publish(count)
            if node.context.wait_for_shutdown(0.05):
                break
"""


def test_six_recorders_at_once(network: Network) -> None:
    """Each holds all topics, or says that messages of the others could come and counts them."""
    talker = network.program(TALKER)
    talker.wait_for("ready")
    programs = [
        network.run("-m", "rosz", "bag", "record", "-a", "-O", str(network.folder / f"{number}"))
        for number in range(RECORDERS)
    ]
    for number, program in enumerate(programs):  # each is ended as soon as it has a bag
        eventually((network.folder / f"{number}.mcap.active").exists, "the bag", 4 * TIMEOUT)
        program.send(signal.SIGINT)
    for number, program in enumerate(programs):
        assert program.exit_code(4 * TIMEOUT) in {0, 1}, program.output
        with open_reader(network.folder / f"{number}.mcap") as reader:
            topics = {channel.topic for channel in reader.channels if reader.count(channel)}
        missing = {f"/t{topic}" for topic in range(TOPICS)} - topics
        assert all(topic in program.output for topic in missing), (missing, program.output)
        if missing:
            assert not re.search(r"\b0 lost", program.output)
            assert "lost" in program.output
    assert talker.process.poll() is None
