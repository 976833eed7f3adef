"""tf2_py and tf compared with the real ones: the same frames, lookups and texts."""

from __future__ import annotations

import pytest
from oracle import ours, real

_FRAMES = """
import genpy
from geometry_msgs.msg import TransformStamped
def put(add, parent, child, stamp, x, turn=0.0):
    one = TransformStamped()
    one.header.frame_id, one.child_frame_id = parent, child
    one.header.stamp = genpy.Time.from_sec(stamp)
    one.transform.translation.x = x
    one.transform.rotation.z, one.transform.rotation.w = turn, (1 - turn**2) ** 0.5
    add(one, "robot")
def at(seconds):
    return genpy.Time.from_sec(seconds)
"""

_BUFFER = (
    _FRAMES
    + """
import tf2_py
buffer = tf2_py.BufferCore()
result = [buffer.all_frames_as_yaml(), buffer.all_frames_as_string()]
put(buffer.set_transform, "map", "odom", 1, 1.0)
put(buffer.set_transform, "map", "odom", 2.5, 4.0)
put(buffer.set_transform, "odom", "base", 2, 0.5, 0.6)
put(buffer.set_transform_static, "base", "laser", 0, 0.25)
put(buffer.set_transform, "apart", "alone", 1, 0.0)
result += [buffer.all_frames_as_yaml(), buffer.all_frames_as_string(), buffer._allFramesAsDot()]
result += [sorted(buffer._getFrameStrings()), bool(buffer._frameExists("map"))]
def found(one):
    t, r = one.transform.translation, one.transform.rotation
    return [one.header.frame_id, one.child_frame_id, one.header.stamp.to_sec(), t.x, t.y, r.z, r.w]
def failed(act):
    try:
        return act()
    except tf2_py.TransformException as error:
        return [type(error).__name__ if "Exc" in type(error).__name__ else None, str(error)]
for target, source, time in (
    ("map", "laser", 0), ("map", "laser", 2), ("laser", "map", 2), ("map", "odom", 1.75),
    ("map", "nothing", 0), ("map", "alone", 0), ("map", "laser", 9), ("map", "odom", 0.5),
):
    can = buffer.can_transform_core(target, source, at(time))
    result.append([bool(can[0]), can[1]])
    looked = failed(lambda: found(buffer.lookup_transform_core(target, source, at(time))))
    result.append(looked[1:])
result.append(found(buffer.lookup_transform_full_core("map", at(1), "odom", at(2.5), "map")))
can = buffer.can_transform_full_core("map", at(0), "laser", at(9), "odom")
result.append([bool(can[0]), can[1]])
result.append(buffer._chain("map", at(0), "laser", at(0), "odom"))
result.append(buffer.get_latest_common_time("map", "laser").to_sec())
"""
)

_TRANSFORMER = (
    _FRAMES
    + """
import rospy, tf
from geometry_msgs.msg import Point32, PointStamped, QuaternionStamped, Vector3Stamped
from sensor_msgs.msg import PointCloud
rospy.rostime.set_rostime_initialized(True)
t = tf.TransformerROS(True, genpy.Duration(10))
for second, (x, turn) in enumerate([(1.0, 0.0), (3.0, 0.3), (4.0, 0.5)], 1):
    put(t.setTransform, "a", "b", second, x, turn)
    put(t.setTransform, "b", "c", second, 0.5)
result = [t.allFramesAsString(), t.allFramesAsDot(), t.getTFPrefix()]
result.append(t.getFrameStrings())
for _ in range(2):
    try:
        result.append(t.waitForTransform("a", "c", at(0), genpy.Duration(1)))
    except tf.Exception:
        result.append("no listener")
    t.setUsingDedicatedThread(True)
half = genpy.Duration.from_sec(0.5)
for time in 0, 1.5, 2.5:
    result.append(t.lookupTwist("b", "a", at(time), half))
    result.append(t.lookupTwistFull("c", "a", "b", (0, 0, 0), "c", at(time), half))
result.append(t.chain("a", at(0), "c", at(0), "a"))
result.append(bool(t.canTransformFull("a", at(1), "c", at(2), "a")))
result.append([t.frameExists("c"), t.frameExists("a")])
result.append(t.lookupTransformFull("a", at(1), "c", at(2), "a"))
for kind, act in (
    (PointStamped, t.transformPoint), (QuaternionStamped, t.transformQuaternion),
    (Vector3Stamped, t.transformVector3), (PointCloud, t.transformPointCloud),
):
    one = kind()
    one.header.frame_id, one.header.stamp = "c", at(2)
    if kind is PointStamped:
        one.point.x = 2.0
    elif kind is QuaternionStamped:
        one.quaternion.w = 1.0
    elif kind is Vector3Stamped:
        one.vector.y = 2.0
    else:
        one.points.append(Point32(1, 2, 3))
    moved = act("a", one)
    names = "point", "quaternion", "vector", "points"
    body = [getattr(moved, n) for n in names if hasattr(moved, n)]
    parts = body[0][0] if kind is PointCloud else body[0]
    result.append([moved.header.frame_id, moved.header.stamp.to_sec()])
    result.append([round(getattr(parts, n), 5) for n in "xyzw" if hasattr(parts, n)])
"""
)


@pytest.mark.ros1
@pytest.mark.parametrize(
    ("snippet", "module"), [(_BUFFER, "tf2_py"), (_TRANSFORMER, "tf")], ids=["tf2_py", "tf"]
)
def test_same_as_the_real_one(snippet: str, module: str) -> None:
    expected = real(snippet, module, "python3-tf2-ros python3-tf")
    for found, wanted in zip(ours(snippet), expected, strict=True):
        assert found == wanted
