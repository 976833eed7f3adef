"""Functions of real rosbag."""

# ruff: noqa: ANN001, ANN201
# mypy: ignore-errors
import contextlib
import io
import os
import time

import rosbag
import rospy
from geometry_msgs.msg import TransformStamped, Twist
from rosbag.rosbag_main import rosbagmain
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Int32, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

os.environ["TZ"] = "UTC"
time.tzset()


def make(path, compression, count, threshold):
    """Write a bag."""
    with rosbag.Bag(path, "w", compression=compression, chunk_threshold=threshold) as bag:
        for number in range(count):
            stamp = rospy.Time(1_500_000_000 + number // 100, (number % 100) * 10_000_000)
            twist = Twist()
            twist.linear.x = number
            bag.write("/cmd_vel", twist, stamp)
            if number % 3 == 0:
                bag.write("/chatter", String(data=f"hello {number}"), stamp)
            if number % 50 == 7:
                frame = TransformStamped(child_frame_id="b")
                frame.header.stamp = stamp
                frame.header.frame_id = "a"
                frame.header.seq = number
                bag.write("/tf", TFMessage([frame]), stamp)
                bag.write("/image", Image(height=4, width=8, step=8, data=bytes(32)), stamp)
                bag.write("/info", CameraInfo(K=[1.0] * 9, D=[0.5]), stamp)
                bag.write("/marker", Marker(ns="n", id=number), stamp)
            if number == 20:
                bag.write("/once", Int32(data=5), stamp)


def command(words, folder):
    """Run a command line; return its exit code and output."""
    os.chdir(folder)
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            rosbagmain(["rosbag", *words])
        except SystemExit as error:
            code = error.code or 0
        except Exception:  # noqa: BLE001
            code = 1
    return code, out.getvalue()


def contents(path):
    """Return the messages of a bag."""
    with rosbag.Bag(path) as bag:
        return [(topic, str(message), stamp.to_nsec()) for topic, message, stamp in bag]
