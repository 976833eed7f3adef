"""rostopic's CallbackEcho, filters of fields and readers of fields, compared with the real ones."""

from __future__ import annotations

import pytest
from oracle import same

_MESSAGES = """
import contextlib, io
import rospy, rostopic
from genpy import Duration, Time
from geometry_msgs.msg import Point, Polygon, Point32, PointStamped
from sensor_msgs.msg import JointState, Image
from std_msgs.msg import Bool, String, UInt8MultiArray
rospy.rostime.set_rostime_initialized(True)
place = PointStamped()
place.header.stamp, place.header.frame_id, place.point.x = Time(3, 5), "map", 1.5
joints = JointState(name=["a", "b"], position=[1.0, -2.5], velocity=[0.25])
joints.header.stamp = Time(1, 2)
polygon = Polygon([Point32(1, 2, 3), Point32(4, 5, 6)])
result = []
"""

_ECHO = """
for message in (place, joints, polygon, Bool(True), String("two words")):
    for no_strings in (False, True):
        for no_arrays in (False, True):
            shown = rostopic.create_field_filter(no_strings, no_arrays)
            notes = rostopic.create_value_transform(no_strings, no_arrays)
            result.append(list(shown(message)))
            for options in ({"plot": True, "field_filter_fn": shown},
                            {"field_filter_fn": shown}, {"value_transform_fn": notes},
                            {"fixed_numeric_width": 9, "echo_clear": True}):
                echo = rostopic.CallbackEcho("/a", None, count=2, **options)
                out = io.StringIO()
                with contextlib.redirect_stdout(out):
                    for topic in ("/b", "/a", "/a", "/a"):
                        echo.callback(message, {"topic": topic}, current_time=Time(7, 8))
                result.append([out.getvalue(), echo.count, echo.done])
"""

_FIELDS = """
paths = ["", "/", "/point/x", "/header/stamp/secs", "/nothing", "/name", "/name[1]",
         "/name[:]", "/name[0", "/name[]", "/name[a]", "/name[9]", "/name[0:2]", "/points[1]/z",
         "/points[:]/y", "/points[0:1]/nothing", "/name[0:1][0]", "/data[0:3]"]
for path in paths:
    with contextlib.redirect_stderr(io.StringIO()):
        read = rostopic.msgevalgen(path)
        for message in (place, joints, polygon, String("abcdef")):
            value = None if read is None else read(message)
            result.append([path, read is None, str(value)])
"""


@pytest.mark.ros1
def test_echo_writes_what_the_real_one_writes() -> None:
    same(_MESSAGES + _ECHO, "rostopic", "python3-rostopic")


@pytest.mark.ros1
def test_fields_are_read_as_by_the_real_one() -> None:
    same(_MESSAGES + _FIELDS, "rostopic", "python3-rostopic")
