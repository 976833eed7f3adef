"""What is sent to one subscription alone."""

from __future__ import annotations

from queue import SimpleQueue

from network import TIMEOUT, Network

from rosz.msgs.std_msgs.msg import String
from rosz.node.publisher import SubscriberLink


def test_all_of_many_messages_to_one_subscription_arrive(network: Network) -> None:
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
