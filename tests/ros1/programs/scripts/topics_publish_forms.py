#!/usr/bin/env python
"""All ways to say what to publish, right and wrong."""

import rospy
from geometry_msgs.msg import Point, PointStamped
from std_msgs.msg import ColorRGBA, Empty, Float32MultiArray, Header, Int8, String, UInt8MultiArray

rospy.init_node("speaker")


def connected(topic, kind):
    got = []
    subscriber = rospy.Subscriber(topic, kind, got.append)
    publisher = rospy.Publisher(topic, kind, queue_size=10)
    while publisher.get_num_connections() < 1:
        rospy.sleep(0.01)
    return publisher, got, subscriber


def attempt(what, made, *args, **kwargs):
    publisher, got, _ = made
    del got[:]
    try:
        publisher.publish(*args, **kwargs)
    except Exception as error:
        print(what, "->", type(error).__name__, error)
        return
    deadline = rospy.get_time() + 60
    while not got and rospy.get_time() < deadline:
        rospy.sleep(0.005)
    print(what, "->", str(got[0]).replace("\n", ", ") if got else "lost")


text, point = connected("text", String), connected("point", Point)
stamped, empty, small = connected("stamped", PointStamped), connected("nothing", Empty), connected("small", Int8)
numbers, octets = connected("numbers", Float32MultiArray), connected("octets", UInt8MultiArray)
attempt("message", text, String("hello"))
attempt("value", text, "hello")
attempt("keyword", text, data="hello")
attempt("nothing", text)
attempt("nothing", empty)
attempt("message", empty, Empty())
attempt("three", point, 1, 2, 3)
attempt("keywords", point, x=1, z=3)
attempt("header", stamped, Header(frame_id="map"), Point(1, 2, 3))
attempt("keyword header", stamped, point=Point(4, 5, 6))
attempt("array", numbers, data=[1, 2.5])
attempt("tuple", numbers, data=(1, 2.5))
attempt("bytes", octets, data=b"abc")
attempt("list of octets", octets, data=[1, 2, 255])
attempt("other message", text, Int8(1))
attempt("number", text, 5)
attempt("two", text, "a", "b")
attempt("unknown keyword", text, text="a")
attempt("value and keyword", text, "a", data="b")
attempt("two of three", point, 1, 2)
attempt("text for number", point, 1, 2, "3")
attempt("too big", small, 300)
attempt("float for int", small, 1.5)
attempt("text for int", small, "1")
attempt("text in array", numbers, data=["a"])
attempt("number for array", numbers, data=5)
attempt("octet too big", octets, data=[300])
attempt("color", connected("color", ColorRGBA), 0.5, 0, 0, 1)
