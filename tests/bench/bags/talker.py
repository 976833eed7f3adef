"""Publish messages at a rate: ``talker.py rosz|rospy SIZE RATE COUNT``; prints the rate kept."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

system, size, rate, count = sys.argv[1], *map(int, sys.argv[2:5])
data = b"x" * size
publish: Any
if system == "rosz":
    import rosz
    from rosz.msgs.geometry_msgs.msg import Twist
    from rosz.msgs.std_msgs.msg import UInt8MultiArray

    node = rosz.Node("bench_talker")
    kind: Any = UInt8MultiArray if size else Twist
    publisher: Any = node.publisher("/bench", kind, queue_size=1000)
    print("ready", flush=True)
    publisher.wait_for_subscribers(timeout=60)
    message = kind(data=data) if size else kind()
    publish = publisher.publish
else:
    import rospy
    from geometry_msgs.msg import Twist as Ros1Twist  # type: ignore[import-not-found]
    from std_msgs.msg import UInt8MultiArray as Ros1Array  # type: ignore[import-not-found]

    rospy.init_node("bench_talker")
    kind = Ros1Array if size else Ros1Twist
    publisher = rospy.Publisher("/bench", kind, queue_size=1000)
    print("ready", flush=True)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    message = kind(data=data) if size else kind()
    publish = publisher.publish
time.sleep(1)
print("begin", flush=True)
begun = time.monotonic()
for number in range(count):
    publish(message)
    ahead = begun + (number + 1) / rate - time.monotonic()
    if ahead > 0.0005:
        time.sleep(ahead)
elapsed = time.monotonic() - begun
time.sleep(2)
print(json.dumps({"rate": count / elapsed}), flush=True)
sys.stdin.readline()
