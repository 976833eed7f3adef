#!/usr/bin/env python
"""A SubscribeListener is told who comes and goes, and greets newcomers alone."""

import threading

import rospy
from std_msgs.msg import String

came, went = threading.Event(), threading.Event()


class Door(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        print("came to", topic_name)
        topic_publish(String("to all"))
        peer_publish(String("to you"))
        came.set()

    def peer_unsubscribe(self, topic_name, num_peers):
        print("left", topic_name, num_peers)
        went.set()


rospy.init_node("host")
publisher = rospy.Publisher("party", String, subscriber_listener=Door(), queue_size=5)
print("before", publisher.get_num_connections())
texts, both = [], threading.Event()


def callback(message):
    texts.append(message.data)
    if len(texts) == 2:
        both.set()


guest = rospy.Subscriber("party", String, callback)
came.wait(60)
both.wait(60)
while guest.get_num_connections() < 1:
    rospy.sleep(0.01)
print(sorted(texts), publisher.get_num_connections(), guest.get_num_connections())
guest.unregister()
went.wait(60)
print("after", publisher.get_num_connections())
