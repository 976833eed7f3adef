"""What is sent to one subscription alone, and the threads that wait for it."""

from __future__ import annotations

import threading
from pathlib import Path
from queue import SimpleQueue

from network import TIMEOUT, Network

from rosz.msgs.std_msgs.msg import String
from rosz.node.publisher import SubscriberLink


def wakes(thread: threading.Thread) -> int:
    """Return how often a thread has given up the processor by itself."""
    status = Path(f"/proc/self/task/{thread.native_id}/status").read_text()
    return int(status.partition("voluntary_ctxt_switches:")[2].split()[0])


def test_all_of_many_messages_to_one_subscription_arrive_and_no_thread_polls(
    network: Network,
) -> None:
    listener, talker = network.node("listener"), network.node("talker")
    came = SimpleQueue[String]()
    listener.subscription("topic", String, came.put, queue_size=500)
    publisher = talker.publisher("topic", String)
    links = SimpleQueue[SubscriberLink[String]]()
    publisher.on_connection(links.put)
    link = links.get(timeout=TIMEOUT)
    for number in range(300):
        link.publish(String(data=str(number)))
    assert [came.get(timeout=TIMEOUT).data for _ in range(300)] == [*map(str, range(300))]
    counts = {one: wakes(one) for one in threading.enumerate() if "pyo3" in one.name}
    assert len(counts) > 2
    assert not threading.Event().wait(2.0)  # in which a thread that polls wakes twenty times
    counts = {one: count for one, count in counts.items() if one.is_alive()}
    assert all(wakes(one) - before < 10 for one, before in counts.items())
