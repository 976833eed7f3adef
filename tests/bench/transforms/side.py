"""Measures one implementation of tf2: ``python side.py``, under rosz or Debian's Python.

Prints JSON: seconds for a lookup in a chain, for taking in a transform, and for a message with many
frames, and the growth of the process in megabytes while more messages come.
"""

from __future__ import annotations

import json
import math
import resource
import sys
import time
from importlib import import_module, util
from typing import Any

CHAIN = 10
FRAMES = 50
RATE = 1000
SECONDS = 12
LOOKUPS = 1000
ROUNDS = 5

if util.find_spec("rosz") is not None:
    import_module("rosz.ros1")
rospy: Any = import_module("rospy")
tf2_ros: Any = import_module("tf2_ros")
TransformStamped: Any = import_module("geometry_msgs.msg").TransformStamped


def transform(parent: str, child: str, stamp: float) -> Any:
    """Return a transform that turns and moves."""
    made = TransformStamped()
    made.header.frame_id, made.child_frame_id = parent, child
    made.header.stamp = rospy.Time.from_sec(stamp)
    made.transform.translation.x = stamp % 1.0
    made.transform.rotation.z, made.transform.rotation.w = math.sin(stamp), math.cos(stamp)
    return made


def best(work: Any, times: int) -> float:
    """Return the seconds of processor time of a call, in the best of several rounds."""
    found = []
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(times):
            work()
        found.append((time.process_time() - began) / times)
    return min(found)


def lookups() -> dict[str, float]:
    """Measure lookups in a chain of moving frames."""
    buffer = tf2_ros.Buffer(debug=False)
    for number in range(CHAIN):
        for tick in range(100):
            stamp = 1000 + tick / 10
            buffer.set_transform(transform(f"f{number}", f"f{number + 1}", stamp), "bench")
    between, latest = rospy.Time.from_sec(1005.05), rospy.Time(0)
    last = f"f{CHAIN}"
    return {
        "lookup at a time": best(lambda: buffer.lookup_transform("f0", last, between), LOOKUPS),
        "lookup of the latest": best(lambda: buffer.lookup_transform("f0", last, latest), LOOKUPS),
        "backwards": best(lambda: buffer.lookup_transform(last, "f0", between), LOOKUPS),
        "can_transform": best(lambda: buffer.can_transform("f0", last, between), LOOKUPS),
    }


def intake() -> dict[str, float]:
    """Measure transforms of many frames that come at a high rate."""
    buffer = tf2_ros.Buffer(debug=False)
    made = [transform("base", f"f{number}", 0.0) for number in range(FRAMES)]
    sizes = []
    began = time.process_time()
    for tick in range(RATE * SECONDS):
        stamp = rospy.Time.from_sec(1000 + tick / RATE)
        for one in made:
            one.header.stamp = stamp
            buffer.set_transform(one, "bench")
        if tick == RATE * SECONDS * 11 // 12 or tick == RATE * SECONDS - 1:
            sizes.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    taken = time.process_time() - began
    return {
        "taking in": taken / (RATE * SECONDS * FRAMES),
        "memory": sizes[-1],
        "growth": sizes[-1] - sizes[0],
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(lookups() | intake()))
