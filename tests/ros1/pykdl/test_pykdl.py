"""PyKDL, tf_conversions and tf2_kdl: the same numbers and texts as the real ones."""

from __future__ import annotations

import copy
import math
import pickle
import subprocess
import sys
from typing import Any

import oracle
import pytest

from rosz.ros1.client import tf2_geometry_msgs, tf2_ros
from rosz.ros1.client.rospy import Time
from rosz.ros1.libraries import PyKDL, tf2_kdl, tf_conversions

_VALUES = """
import copy, math, random
import PyKDL
from PyKDL import Frame, Rotation, Twist, Vector, Wrench
draw = random.Random(5)
texts, numbers = [], []
def flat(value):
    if isinstance(value, (Frame, Rotation)):
        columns = 4 if isinstance(value, Frame) else 3
        return [value[row, column] for row in range(3) for column in range(columns)]
    if isinstance(value, (tuple, list)):
        return [one for each in value for one in flat(each)]
    return list(value) if isinstance(value, (Vector, Twist, Wrench)) else [value]
def note(*values):
    numbers.extend(repr(float(one)) for value in values for one in flat(value))
def show(*values):
    texts.extend(repr(value) + str(value) for value in values)
    note(*values)
def angle():
    return draw.choice([draw.uniform(-7, 7), 0.0, math.pi, math.pi / 2, -math.pi / 2, 1e-8, 3e-6])
def vector():
    return Vector(*(draw.choice([draw.uniform(-9, 9), 0.0, 1e-8, 1e5]) for _ in range(3)))
def told(act):
    try:
        return repr(act())
    except Exception as error:
        return type(error).__name__
"""

_GEOMETRY = (
    _VALUES
    + """
for round in range(100):
    a, b, c = angle(), angle(), angle()
    v, u = vector(), vector()
    made = [Rotation.RPY(a, b, c), Rotation.EulerZYX(a, b, c), Rotation.EulerZYZ(a, b, c)]
    made += [Rotation.RotX(a), Rotation.RotY(b), Rotation.RotZ(c), Rotation.Rot(v, a)]
    unit = Vector(v)
    note(v.Norm(), v.Norm(1e-3), unit.Normalize())
    made += [Rotation.Rot2(unit, b), Rotation.Quaternion(*Rotation.Rot(u, c).GetQuaternion())]
    show(v, unit, *made)
    for r in made:
        note(r.GetRPY(), r.GetEulerZYX(), r.GetEulerZYZ(), r.GetQuaternion(), r.GetRot())
        note(*r.GetRotAngle(), *r.GetRotAngle(1e-3), r.UnitX(), r.UnitY(), r.UnitZ(), r.Inverse())
    r, s = draw.sample(made, 2)
    f, g = Frame(r, v), Frame(s, u)
    t, w = Twist(v, u), Wrench(u, v)
    show(f, t, w, Frame(v), Frame(r), Rotation(v, u, unit), Frame.DH(a, b, c, a))
    show(Frame.DH_Craig1989(a, b, c, a), v + u, v - u, -v, v * a, a * v, v * u, t * 2, 3 * w, -t)
    for moving in r, f:
        note(moving * v, moving * t, moving * w, moving.Inverse())
        note(moving.Inverse(v), moving.Inverse(t), moving.Inverse(w))
    note(r * s, f * g, v / 3, t / 7, w / 9, t + t * a, w - w * b, t.RefPoint(u), w.RefPoint(v))
    note(PyKDL.dot(v, u), PyKDL.dot(t, w), PyKDL.dot(w, t))
    for one, other in (v, u), (r, s), (f, g), (t, t * b), (w, w * c):
        note(PyKDL.diff(one, other), PyKDL.diff(one, other, 0.25), PyKDL.Equal(one, other))
        note(PyKDL.Equal(one, other, 3), one == other, one != other, PyKDL.Equal(one, one))
    note(PyKDL.addDelta(v, u, a), PyKDL.addDelta(r, u * 1e-3), PyKDL.addDelta(f, t * 1e-6, 0.5))
    note(PyKDL.addDelta(t, t), PyKDL.addDelta(w, w, 2))
    r = Rotation(s)
    r.DoRotX(a), r.DoRotY(b), r.DoRotZ(c), note(r), r.SetInverse(), note(r), r.UnitY(v), note(r)
    f.Integrate(t * 0.01, 50), note(f), f.Integrate(Twist(v, Vector()), 10), note(f)
    v += u
    t -= t * 2
    f.p[1], f[0, 3], f.M[2, 0], f[1, 1], t[4], w[0] = 1, 2, 3, 4, 5, 6
    v.x(a), v.ReverseSign(), t.ReverseSign(), w.ReverseSign()
    show(v, t, f)
    note(v.y(), w)
    PyKDL.SetToZero(w), note(w)
result = [texts, numbers]
"""
)

_REFUSED = (
    _VALUES
    + """
v, r, f, t, w = Vector(1, 2, 3), Rotation(), Frame(), Twist(), Wrench()
half = Frame(Rotation.RotX(math.pi), v)
origin, turned = half.p, half.M
half.p, half.M = Vector(4, 5, 6), Rotation.RotZ(1)
result = [told(act) for act in (
    lambda: v[3], lambda: v[-1], lambda: v["a"], lambda: r[0], lambda: r[3, 0], lambda: r[0, -1],
    lambda: f[3, 0], lambda: f[0, 4], lambda: f[0, 3], lambda: t[6], lambda: w[5], lambda: len(v),
    lambda: hash(v), lambda: hash(f), lambda: v + 1, lambda: v * r, lambda: t * w, lambda: t + w,
    lambda: r * 2, lambda: r + r, lambda: f * 2, lambda: "a" * v, lambda: v / v, lambda: v - t,
    lambda: Vector("a"), lambda: Vector(1, 2), lambda: Vector("1", "2", "3"), lambda: Frame(1),
    lambda: Frame(v, r), lambda: Twist(v), lambda: Rotation(1, 2, 3), lambda: Rotation(a=1),
    lambda: Rotation.RPY(1, 2), lambda: Rotation.Rot(1, 2), lambda: PyKDL.diff(v, w),
    lambda: PyKDL.dot(v, t), lambda: PyKDL.Equal(v, r), lambda: PyKDL.SetToZero(r),
    lambda: f.Inverse(f), lambda: r.Inverse(1), lambda: setattr(v, "x", 3), lambda: v.x(),
    lambda: setattr(f, "p", 3), lambda: v == (1, 2, 3), lambda: v != None, lambda: f == r,
    lambda: Vector(1 + 1e-9, 2, 3) == v, lambda: list(v), lambda: v / 0, lambda: Vector() / -0.0,
    lambda: Vector(x=1, y=2, z=3), lambda: Twist(vel=v, rot=v), lambda: Wrench(torque=v, force=v),
    lambda: Rotation(x=v, y=v, z=v), lambda: Rotation(1, 0, 0, 0, 1, 0, 0, 0, zz=4),
    lambda: [origin, turned, half.p is origin], lambda: v.__getstate__(), lambda: r.__getstate__(),
    lambda: t.__getstate__(), lambda: half.__getstate__(), lambda: copy.deepcopy([v, half, t, w]),
    lambda: Rotation.Quaternion(0, 0, 0, 0).GetQuaternion(), lambda: Vector(1e20, -0.0, 1e-20),
    lambda: Vector(math.inf, -math.inf, 1234567.8), lambda: Vector().Normalize(),
    lambda: Rotation(1, 0, 0, 0, 0, 1, 0, 1, 0).GetRotAngle(),
    lambda: [Vector.Zero(), Twist.Zero(), Wrench.Zero(), Rotation.Identity(), Frame.Identity()],
)]
result = [text.replace("-nan", " nan") for text in result]  # C++ tells the sign of its nan
"""
)

_CONVERSIONS = """
import random
import numpy
import tf_conversions, tf2_kdl, tf2_geometry_msgs, PyKDL
from geometry_msgs.msg import TransformStamped
from tf_conversions import posemath
draw = random.Random(7)
result = []
for _ in range(50):
    turned = PyKDL.Rotation.RPY(*(draw.uniform(-3, 3) for _ in range(3)))
    v, u = (PyKDL.Vector(*(draw.uniform(-9, 9) for _ in range(3))) for _ in range(2))
    frame = PyKDL.Frame(turned, v)
    pose = posemath.toMsg(frame)
    at, q = pose.position, pose.orientation
    result += [at.x, at.y, at.z, q.x, q.y, q.z, q.w, str(posemath.fromMsg(pose))]
    result += [posemath.toTf(frame), str(tf_conversions.fromTf(posemath.toTf(frame)))]
    result += [posemath.toMatrix(frame), str(posemath.fromMatrix(posemath.toMatrix(frame)))]
    moved = TransformStamped()
    moved.transform.translation, moved.transform.rotation = at, q
    result += [str(tf2_kdl.transform_to_kdl(moved))]
    result += [str(tf2_geometry_msgs.transform_to_kdl(moved) * u)]
result += [sorted(set(dir(posemath)) & set("fromTf toTf fromMsg toMsg fromMatrix toMatrix Frame"
           " fromCameraParams Vector transformations Pose Point Quaternion numpy".split()))]
result += [sorted(one for one in dir(tf2_kdl) if one.islower() and not one.startswith("_")
           and one not in ("rospy", "tf2_ros", "tf2_kdl", "annotations"))]
"""


def _numbers_are_near(found: list[str], expected: list[str]) -> None:
    assert len(found) == len(expected)
    for at, (one, other) in enumerate(zip(found, expected, strict=True)):
        near = math.isclose(float(one), float(other), rel_tol=1e-12, abs_tol=1e-12)
        assert near, f"number {at}: rosz {one}, real {other}"


@pytest.mark.ros1
def test_numbers_and_texts_are_those_of_the_real_module() -> None:
    expected = oracle.real(_GEOMETRY, "PyKDL", "python3-pykdl")
    texts, numbers = oracle.ours(_GEOMETRY)
    _numbers_are_near(numbers, expected[1])
    for found, text in zip(texts, expected[0], strict=True):
        assert found == text


@pytest.mark.ros1
def test_what_is_refused_and_what_is_printed() -> None:
    oracle.same(_REFUSED, "PyKDL", "python3-pykdl")


@pytest.mark.ros1
def test_conversions() -> None:
    oracle.require("tf_conversions", "tf2_kdl", package="python3-tf-conversions python3-tf2-kdl")
    oracle.same(_CONVERSIONS, "PyKDL", "python3-pykdl")


@pytest.mark.ros1
def test_pickles_of_the_real_module_load() -> None:
    written = oracle.real(
        """
        import pickle, PyKDL
        v = PyKDL.Vector(1, 2, 3)
        given = PyKDL.Frame(PyKDL.Rotation.RPY(0.1, 0.2, 0.3), v), PyKDL.Twist(v, -v)
        result = [pickle.dumps(given, 2).hex(), repr(given)]
        """,
        "PyKDL",
        "python3-pykdl",
    )
    loaded = oracle.ours(
        f"import pickle; result = repr(pickle.loads(bytes.fromhex({written[0]!r})))"
    )
    assert loaded == written[1]


def _values() -> list[Any]:
    v = PyKDL.Vector(1, 2, 3)
    turned = PyKDL.Rotation.RPY(0.1, 0.2, 0.3)
    return [v, turned, PyKDL.Frame(turned, v), PyKDL.Twist(v, -v), PyKDL.Wrench(-v, v)]


@pytest.mark.parametrize("value", _values())
def test_a_copy_is_equal_and_apart(value: Any) -> None:
    for copied in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
        assert copied == value
        assert type(copied) is type(value)
        place = (0, 0) if isinstance(value, PyKDL.Rotation | PyKDL.Frame) else 0
        copied[place] = 9
        assert copied != value


@pytest.mark.parametrize("name", ["Chain", "Tree", "ChainIkSolverPos_LMA", "JntArray", "FrameVel"])
def test_what_is_cpp_says_so(name: str) -> None:
    with pytest.raises(AttributeError, match=rf"'{name}': it needs KDL's C\+\+.*python3-pykdl"):
        getattr(PyKDL, name)


def test_an_unknown_name_is_not_said_to_be_cpp() -> None:
    with pytest.raises(AttributeError, match=r"has no attribute 'Vektor'$"):
        PyKDL.Vektor  # noqa: B018


def _buffer() -> Any:
    buffer = tf2_ros.Buffer()
    moved = tf2_ros.TransformStamped()
    moved.transform.translation.x = 1
    moved.transform.rotation.x, moved.transform.rotation.w = 1, 0
    moved.header.stamp, moved.header.frame_id, moved.child_frame_id = Time(2), "a", "b"
    buffer.set_transform(moved, "test")
    return buffer


def test_a_buffer_transforms_values_of_pykdl() -> None:
    buffer, v, u = _buffer(), PyKDL.Vector(1, 2, 3), PyKDL.Vector(4, 5, 6)
    expected = [
        (v, [0, -2, -3]),
        (PyKDL.Twist(v, u), [1, -8, 2, 4, -5, -6]),
        (PyKDL.Wrench(v, u), [1, -2, -3, 4, -8, -4]),
    ]
    for value, numbers in expected:
        moved = buffer.transform(tf2_ros.Stamped(value, Time(2), "a"), "b")
        assert list(moved) == numbers
        assert moved.header.frame_id == "b"
    frame = tf2_ros.Stamped(PyKDL.Frame(v), Time(2), "a")
    assert list(buffer.transform(frame, "b").p) == [0, -2, -3]


def test_vectors_convert() -> None:
    stamped = tf2_ros.Stamped(PyKDL.Vector(1, 2, 3), Time(2), "a")
    converted = tf2_ros.convert(stamped, PyKDL.Vector)
    assert list(converted) == [1, 2, 3]
    assert converted is not stamped
    assert converted.header == stamped.header
    message = tf2_kdl.to_msg_vector(stamped)
    assert (message.point.z, message.header.frame_id) == (3, "a")
    assert tf2_kdl.from_msg_vector(message) == stamped
    assert tf2_geometry_msgs.to_msg_msg(message) is message


class _OldOpenCv:
    @staticmethod
    def Rodrigues2(_: Any, matrix: Any) -> None:  # noqa: N802  # OpenCV's
        matrix[:] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]


def test_camera_parameters() -> None:
    column = {(row, 0): float(row + 1) for row in range(3)}
    frame = tf_conversions.fromCameraParams(_OldOpenCv, None, column)
    assert frame == PyKDL.Frame(PyKDL.Rotation.RotX(math.pi / 2), PyKDL.Vector(1, 2, 3))
    assert tf_conversions.toMatrix(frame)[3].tolist() == [0, 0, 0, 1]


def test_it_needs_no_numpy() -> None:
    code = "import sys, rosz.ros1, PyKDL, tf_conversions.posemath, tf2_kdl"
    code += "; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
