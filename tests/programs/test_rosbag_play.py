"""``rosrun rosbag play``, with Debian's bags and an unmodified node of rospy in their time."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import oracle
import pytest
from network import Network
from ros1.programs.runners import Ros

from rosz.cli.main import run

from .sides import RealSide, RoszSide, run_script

COUNT = 100
MESSAGES = COUNT + 34 + 2 + 1 + 2
SCRIPT = """
import re
import threading
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Int32, String
from tf2_msgs.msg import TFMessage
from sensor_msgs.msg import Image

rospy.set_param("/use_sim_time", True)
rospy.init_node("listener")
begin = 1500000000
done = threading.Event()
lines, latest = [], [0]

def add(*words):
    lines.append(words)
    if len(lines) == MESSAGES:
        done.set()

def near(number):
    # The time of the bag, not that of the wall, and never back.
    now = rospy.get_time()
    late = now - begin - number / 100  # on a busy machine, by any time
    fits = now == 0 or (latest[0] <= now and -1 < late < 1000)
    latest[0] = now
    return fits

def twist(message):
    add("cmd_vel", message.linear.x, near(message.linear.x))

def note(message, topic):
    header = message._connection_header
    text = re.sub("seq: [0-9]+", "seq", str(message)).split()  # which CDR does not have
    add(topic, header["type"], header["topic"], header["md5sum"], text)

rospy.Subscriber("/cmd_vel", Twist, twist, queue_size=1000)
kinds = {"/chatter": String, "/tf": TFMessage, "/once": Int32, "/image": Image}
for topic, kind in kinds.items():
    rospy.Subscriber(topic, kind, note, topic, queue_size=1000)
ended = done.wait(90)
rospy.delete_param("/use_sim_time")
rospy.sleep(0)
print("ended", ended, rospy.Time.now().secs - begin)
for line in sorted(lines, key=lambda line: line[0]):
    print(*line)
""".replace("MESSAGES", str(MESSAGES))
TOPICS = ("/cmd_vel", "/chatter", "/tf", "/once", "/image")
PLAY = ("rosbag", "play", "-q", "--clock", "--wait-for-subscribers", "--topics", *TOPICS, "--bags")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    oracle.require("rosbag", "roslz4", package="rosbag, python3-rosbag")
    made = tmp_path_factory.mktemp("bags")
    with closing(oracle.Worker("rosbag_calls")) as worker:
        for compression in ("none", "bz2", "lz4"):
            worker.call("make", str(made / f"{compression}.bag"), compression, COUNT, 4000)
    return made


@pytest.mark.ros1
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_node_in_simulated_time_prints_the_same(
    ros: Ros, network: Network, folder: Path, tmp_path: Path, compression: str
) -> None:
    bag = str(folder / f"{compression}.bag")
    expected = run_script(RealSide(ros), tmp_path, SCRIPT, [*PLAY, bag])
    assert run_script(RoszSide(network), tmp_path, SCRIPT, [*PLAY, bag]) == expected
    assert expected[0] == "ended True 0"
    assert len(expected) == MESSAGES + 1
    assert not any(line.endswith("False") for line in expected)
    if compression == "lz4":  # Debian's program plays what rosz wrote, too
        there, back = str(tmp_path / "x.mcap"), str(tmp_path / "x.bag")
        assert run(["bag", "convert", bag, there]) == 0
        assert run(["bag", "convert", there, back, "--compression", "lz4"]) == 0
        assert run_script(RealSide(ros), tmp_path, SCRIPT, [*PLAY, back]) == expected
