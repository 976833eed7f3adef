"""How fast ``rosz bag play -i`` plays, beside Debian's rosbag: ``python -m tests.bench.bags.play``.

Both play one bag of 100 000 messages in turn, to nobody and to an unmodified node of rospy. Each
line is one run: seconds from the start of the program to its end, CPU time, messages received.
Then both play 5 seconds of the bag at its times, 1000 messages of each topic per second, and a line
says by how many milliseconds the messages came late, measured from the earliest one.
In turn with these runs, a bare publisher of Zenoh puts as many messages that are ready to one
subscriber: seconds for that alone, without the start of a program.
With ``--real-time``, all run before the other programs of the machine, which takes root.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from network import Network, Program
from programs.sides import RealSide, RoszSide
from ros1.programs.runners import Ros

from rosz.bags import Channel
from rosz.bags.formats.ros1_form import to_ros1
from rosz.bags.formats.ros1_writer import Ros1Writer
from rosz.msgs.geometry_msgs.msg import TransformStamped, Twist
from rosz.msgs.sensor_msgs.msg import Imu
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.typestore import TypeStore

from .conditions import prepare  # tests is no package

COUNT = 33_334
ROUNDS = 5
SECONDS = 5
LISTEN = """
import rospy, sys, time
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage
rospy.init_node("listener")
found, times = [], []
def time_of(message):
    found.append(1)
    times.append(time.monotonic())
rospy.Subscriber("/cmd_vel", Twist, time_of)
for name, kind in (("/imu", Imu), ("/tf", TFMessage)):
    rospy.Subscriber(name, kind, lambda message: found.append(1))
print("ready", flush=True)
sys.stdin.readline()
last = -1
while last != len(found):
    last = len(found)
    time.sleep(1)
late = [moment - number / 1000 for number, moment in enumerate(times)]
first = min(late)
late = sorted((one - first) * 1000 for one in late)
print(" ".join(f"{late[int(len(late) * share)]:.2f}" for share in (0.5, 0.95, 0.99, 0.999)))
print(len(found), flush=True)
"""


def make(path: Path) -> None:
    """Write the bag."""
    imu = Imu()
    imu.header.frame_id = "base_link"
    frame = TransformStamped(child_frame_id="base_link")
    frame.header.frame_id = "odom"
    messages = {"/cmd_vel": Twist(), "/imu": imu, "/tf": TFMessage([frame])}
    with Ros1Writer(path) as writer:
        rows = []
        for topic, message in messages.items():
            channel, translate = to_ros1(Channel(topic, message._type_name), TypeStore())
            rows.append((writer.add(channel), translate(message.to_cdr(), 0)))
        for number in range(COUNT):
            for handle, data in rows:
                writer.write(handle, 10**18 + number * 1_000_000, data)


def play(
    side: RealSide | RoszSide, bag: Path, *, heard: bool, timed: bool = False
) -> dict[str, Any]:
    """Play the bag once, as fast as possible or a part of it at its times."""
    script = bag.with_name("listen.py")
    script.write_text(LISTEN)
    listener = Program([*side.script(), str(script)], side.variables) if heard else None
    if isinstance(side, RealSide):
        command = ["/usr/lib/rosbag/play"]
    else:
        command = [sys.executable, "-m", "rosz", "bag", "play"]
    try:
        if listener is not None:
            listener.wait_for("ready")
            time.sleep(1)
        before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        words = [*command, "-q", *(["-u", str(SECONDS)] if timed else ["-i"]), str(bag)]
        subprocess.run(words, env=side.variables, check=True, stdout=subprocess.DEVNULL)
        elapsed, after = time.monotonic() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
        received, late = 0, ""
        if listener is not None:
            listener.say("")
            listener.exit_code()
            late, received = listener.lines[-2], int(listener.lines[-1])
    finally:
        if listener is not None:
            listener.close()
    if timed:
        return {
            "system": type(side).__name__,
            "late ms (50, 95, 99, 99.9 %)": late,
            "received": received,
            "load": round(os.getloadavg()[0], 1),
        }
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "system": type(side).__name__,
        "subscriber": heard,
        "seconds": round(elapsed, 2),
        "CPU seconds": round(used, 2),
        "received": received,
        "received/s": round(received / elapsed),
        "of": 3 * COUNT,
        "load": round(os.getloadavg()[0], 1),
    }


def put(network: Network) -> dict[str, Any]:
    """Publish as many messages over nothing but Zenoh."""
    command = [sys.executable, str(Path(__file__).with_name("bare.py")), "put", str(3 * COUNT)]
    done = subprocess.run(
        command, env=network.variables(), check=True, capture_output=True, text=True
    )
    seconds = json.loads(done.stdout.splitlines()[-1])["seconds"]
    return {"system": "zenoh, put alone", "seconds": round(seconds, 2)}


def main() -> None:
    prepare()
    with tempfile.TemporaryDirectory(prefix="rosz-bench-") as folder:
        bag = Path(folder) / "x.bag"
        make(bag)
        network, ros = Network(173), Ros(Path(folder))
        try:
            for heard in (False, True):
                for _ in range(ROUNDS):
                    for side in (RoszSide(network), RealSide(ros)):
                        print(json.dumps(play(side, bag, heard=heard)), flush=True)
                    if heard:
                        print(json.dumps(put(network)), flush=True)
            for _ in range(ROUNDS):
                for side in (RoszSide(network), RealSide(ros)):
                    print(json.dumps(play(side, bag, heard=True, timed=True)), flush=True)
        finally:
            ros.close()
            network.close()


if __name__ == "__main__":
    main()
