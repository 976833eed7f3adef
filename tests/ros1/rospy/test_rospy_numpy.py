"""numpy_msg: sequences of numbers as numpy arrays, encoded and decoded."""

from __future__ import annotations

import pytest

from rosz.msgs.nav_msgs.msg import OccupancyGrid
from rosz.msgs.sensor_msgs.msg import Image, JointState, LaserScan, MultiDOFJointState
from rosz.ros1.client.rospy.numpy_msg import numpy_msg

from .rospy_programs import Printed

np = pytest.importorskip("numpy")


def test_classes() -> None:
    scans = numpy_msg(LaserScan)
    assert numpy_msg(LaserScan) is scans
    assert issubclass(scans, LaserScan)
    assert scans.__name__ == "Numpy_sensor_msgs__LaserScan"
    assert (scans._type, scans._md5sum) == (LaserScan._type, LaserScan._md5sum)


def test_arrays_arrive() -> None:
    scan = numpy_msg(LaserScan)(ranges=np.array([1.5, 2.0], dtype=np.float32))
    scan.header.frame_id = "laser"
    back = numpy_msg(LaserScan).from_cdr(scan.to_cdr())
    assert isinstance(back, numpy_msg(LaserScan))
    assert back.header.frame_id == "laser"
    assert back.ranges.dtype == np.float32
    assert back.ranges.tolist() == [1.5, 2.0]
    assert back.intensities.shape == (0,)
    back.ranges *= 2  # the memory is the message's own
    assert back.ranges.tolist() == [3.0, 4.0]


@pytest.mark.parametrize(
    ("kind", "field", "values", "dtype"),
    [
        (JointState, "position", [1.0, -2.0], np.float64),
        (OccupancyGrid, "data", [-1, 100, 0], np.int8),
    ],
)
def test_kinds_of_numbers(kind: type, field: str, values: list[float], dtype: type) -> None:
    back = numpy_msg(kind).from_cdr(kind(**{field: values}).to_cdr())
    assert getattr(back, field).dtype == dtype
    assert getattr(back, field).tolist() == values


def test_octets_and_texts_are_not_arrays() -> None:
    assert numpy_msg(Image).from_cdr(Image(data=b"ab").to_cdr()).data == b"ab"
    state = MultiDOFJointState(joint_names=["a"])
    assert numpy_msg(MultiDOFJointState).from_cdr(state.to_cdr()).joint_names == ["a"]


def test_on_a_topic(printed: Printed) -> None:
    assert printed("""
        import time
        import numpy as np
        import rospy
        from rospy.numpy_msg import numpy_msg
        from rospy_tutorials.msg import Floats
        rospy.init_node("arrays")
        out = rospy.Publisher("floats", numpy_msg(Floats), queue_size=1, latch=True)
        out.publish(np.array([1.0, 2.5], dtype=np.float32))
        got = rospy.wait_for_message("floats", numpy_msg(Floats), 10)
        print(type(got.data).__name__, got.data.dtype, got.data.tolist())
        print(rospy.wait_for_message("floats", Floats, 60).data)
        """) == ["ndarray float32 [1.0, 2.5]", "(1.0, 2.5)"]
