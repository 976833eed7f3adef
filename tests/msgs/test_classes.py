"""What message and service classes offer besides their codec."""

from __future__ import annotations

import copy
import io
import math
import pickle
import subprocess
import sys
from array import array
from pathlib import Path
from typing import Any

import pytest

from rosz.message import Derived, Message, Service
from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.msgs.diagnostic_msgs.msg import DiagnosticStatus
from rosz.msgs.geometry_msgs.msg import (
    Point32,
    Polygon,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    Vector3,
)
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.rospy_tutorials.srv import AddTwoInts, AddTwoIntsRequest, AddTwoIntsResponse
from rosz.msgs.sensor_msgs.msg import CameraInfo, Image, JointState
from rosz.msgs.std_msgs.msg import Float64, Header, String, UInt8MultiArray
from rosz.msgs.std_srvs.srv import SetBool, Trigger
from rosz.msgs.stereo_msgs.msg import DisparityImage
from rosz.typestore import TypeStore

from . import values
from .invented import Written

TOP = Path(__file__).parents[2]


def test_construction() -> None:
    assert Twist() == Twist(Vector3(0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))
    assert Twist(angular=Vector3(z=1.0)).angular.z == 1.0
    assert Header(3, Time(1, 2), "map").seq == 3
    with pytest.raises(TypeError, match="Unexpected keyword argument 'lineer'"):
        Twist(lineer=Vector3())  # type: ignore[call-arg]
    with pytest.raises(AttributeError, match="no attribute 'lineer'"):
        Twist().lineer = 1  # type: ignore[attr-defined]


def test_defaults_are_not_shared() -> None:
    one, other = JointState(), JointState()
    one.name.append("a")
    one.header.frame_id = "map"
    positions: Any = one.position
    positions.append(1.0)
    assert other == JointState()
    assert Pose().orientation.w == 1.0  # as the definition says


def test_defaults_by_kind() -> None:
    made = Written(
        "float32 a 0.5\nstring b 'x y'\nint16[] c [1, -2]\nuint8[3] d\nfloat64[2] e\nbool[2] f\n"
        "string[2] g\nP[2] h\nfloat64 i nan\nfloat64 j -inf\nuint8[2] k [1, 255]\n"
        "string[] l ['a']\nbool m true\nbool[<=2] n [true]\nbyte o -1",
        P="int8 x 7",
    )()
    assert (made.a, made.b, made.c, made.d) == (0.5, "x y", [1, -2], bytes(3))
    assert (made.e, made.f, made.g) == ([0.0, 0.0], [False, False], ["", ""])
    assert [each.x for each in made.h] == [7, 7]
    assert made.h[0] is not made.h[1]
    assert math.isnan(made.i)
    assert (made.j, made.k, made.l, made.m, made.n) == (
        -float("inf"),
        b"\1\xff",
        ["a"],
        True,
        [True],
    )
    assert made.o == -1
    assert type(made).from_cdr(made.to_cdr()).o == 255


def test_equality_copies_and_pickles() -> None:
    pose = PoseStamped(Header(9, Time(1, 2), "map"), Pose())
    for twin in (copy.copy(pose), copy.deepcopy(pose), pickle.loads(pickle.dumps(pose))):
        assert twin == pose
        assert twin.header.seq == 9
    deep = copy.deepcopy(pose)
    deep.pose.position.x = 5.0
    assert deep != pose
    assert pose.pose.position.x == 0.0
    other: Any = Vector3()
    assert Twist() != other
    with pytest.raises(TypeError, match="unhashable"):
        hash(pose)


def test_sequences_are_equal_by_their_elements() -> None:
    sent = Odometry(pose=PoseWithCovariance(covariance=[1.0] * 36))
    received = Odometry.from_cdr(sent.to_cdr())
    assert type(sent.pose.covariance) is not type(received.pose.covariance)
    assert sent == received
    assert not sent != received  # noqa: SIM202  # another function
    received.pose.covariance[35] = 2.0
    assert not sent == received  # noqa: SIM201
    assert sent != received
    same: tuple[Any, ...] = ([1, 2], (1, 2), b"\1\2", array("B", (1, 2)), memoryview(b"\1\2"))
    for data in same:
        assert UInt8MultiArray(data=data) == UInt8MultiArray(data=b"\1\2")
        assert UInt8MultiArray(data=data) != UInt8MultiArray(data=b"\1\2\3")
    nothing: Any = None
    assert UInt8MultiArray(data=nothing) != UInt8MultiArray(data=[])
    assert Polygon([Point32(1.0)]) != Polygon([Point32(2.0)])
    points: Any = (Point32(1.0),)
    assert Polygon(points) == Polygon([Point32(1.0)])


def test_arrays_of_numpy_are_equal_by_their_elements() -> None:
    numpy = pytest.importorskip("numpy")
    stamped = JointState(position=numpy.array([1.0, 2.0]))
    assert stamped == JointState(position=numpy.array([1.0, 2.0])) == JointState(position=[1, 2])
    assert stamped != JointState(position=numpy.array([1.0, 3.0]))


def test_a_subclass_may_compare_in_its_own_way() -> None:
    class Tagged(JointState, metaclass=Derived):
        def __eq__(self, other: object) -> bool:
            return isinstance(other, JointState)

        __hash__ = None  # type: ignore[assignment]

    assert Tagged() == JointState(name=["hip"])


def test_repr() -> None:
    assert repr(Vector3(1.0)) == "Vector3(x=1.0, y=0.0, z=0.0)"
    assert repr(Header()) == "Header(seq=0, stamp=Time(sec=0, nanosec=0), frame_id='')"


def test_headers_have_a_sequence_number_beside_the_wire() -> None:
    header = Header(frame_id="map")
    header.seq = 7
    assert Header.from_cdr(header.to_cdr()).seq == 0
    assert Header.from_cdr(header.to_cdr()) == header
    assert header != Header(frame_id="odom")
    assert header != 5
    assert not Header(1) != Header(2)  # noqa: SIM202  # another function
    assert Header._has_header is False
    assert (Image._has_header, String._has_header) == (True, False)
    assert Written("Header head")()._has_header is False
    assert Written("Header header")()._has_header is True


def test_names_and_hashes() -> None:
    assert (Twist._type, Twist._type_name) == ("geometry_msgs/Twist", "geometry_msgs/msg/Twist")
    assert Twist._md5sum == "9f195f881246fdfa2798d1d3eebca84a"
    assert Twist._type_hash.startswith("RIHS01_9c45bf16")
    assert Twist()._type == Twist._type


def test_introspection() -> None:
    assert JointState.__slots__ == ["header", "name", "position", "velocity", "effort"]
    assert JointState._slot_types == [
        "std_msgs/Header",
        "string[]",
        *["float64[]"] * 3,
    ]
    assert Header.__slots__ == ["seq", "stamp", "frame_id"]
    assert Header._slot_types == ["uint32", "time", "string"]
    assert JointState()._get_types() == JointState._slot_types
    assert JointState.get_fields_and_field_types() == {
        "header": "std_msgs/Header",
        "name": "sequence<string>",
        "position": "sequence<double>",
        "velocity": "sequence<double>",
        "effort": "sequence<double>",
    }
    bounded = Written(
        "string<=3[<=2] a\nfloat32[4] b\nbyte c\nbool[] d\nwstring e\nduration f"
    ).module
    assert bounded.It.get_fields_and_field_types() == {
        "a": "sequence<string<3>, 2>",
        "b": "float[4]",
        "c": "octet",
        "d": "sequence<boolean>",
        "e": "wstring",
        "f": "builtin_interfaces/Duration",
    }
    assert bounded.It._slot_types[-1] == "duration"
    assert bounded.It._slot_types[0] == "string<=3[<=2]"


def test_constants() -> None:
    assert (DiagnosticStatus.OK, DiagnosticStatus.STALE) == (0, 3)
    assert DiagnosticStatus().OK == 0


def test_full_text() -> None:
    own, *below = PoseStamped._full_text.split("=" * 80 + "\nMSG: ")
    assert own.rstrip("\n") == PoseStamped._text.rstrip("\n")
    assert [part.partition("\n")[0] for part in below] == [
        "std_msgs/Header",
        "builtin_interfaces/Time",
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
    ]
    assert SetBool._full_text == SetBool._text


def test_services() -> None:
    assert AddTwoInts.Request is AddTwoIntsRequest is AddTwoInts._request_class
    assert AddTwoInts.Response is AddTwoIntsResponse is AddTwoInts._response_class
    assert AddTwoIntsRequest(2, 3).a == 2
    assert AddTwoIntsRequest._type == "rospy_tutorials/AddTwoIntsRequest"
    assert AddTwoIntsRequest._type_name == "rospy_tutorials/srv/AddTwoInts_Request"
    assert (AddTwoInts._type, AddTwoInts._type_name) == (
        "rospy_tutorials/AddTwoInts",
        "rospy_tutorials/srv/AddTwoInts",
    )
    assert issubclass(Trigger, Service)
    assert "---" in Trigger._text


def test_genpy_spellings_of_the_codec() -> None:
    buffer = io.BytesIO()
    String("hi").serialize(buffer)
    assert buffer.getvalue() == String("hi").to_ros1() == b"\x02\0\0\0hi"
    message = String("old")
    assert message.deserialize(buffer.getvalue()) is message
    assert message.data == "hi"


def test_ros_1_names_of_fields() -> None:
    info = CameraInfo()
    info.K = [1.0] * 9
    info.D = [0.5]
    assert list(info.k) == [1.0] * 9
    assert info.P is info.p
    assert info.R is info.r
    assert array("d", [0.5]) == CameraInfo.from_cdr(info.to_cdr()).D


def test_ros_1_names_of_members() -> None:
    info_type: Any = CameraInfo
    info = info_type(K=[1.0] * 9, D=[0.5], height=3)
    assert info == CameraInfo(k=[1.0] * 9, d=[0.5], height=3)
    assert pickle.loads(pickle.dumps(info)) == copy.deepcopy(info) == info
    assert DisparityImage(T=0.1).t == 0.1  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="'K' and 'k' are the same field: give one"):
        info_type(K=[1.0] * 9, k=[1.0] * 9)
    with pytest.raises(TypeError, match="Unexpected keyword argument 'X'"):
        info_type(X=1)


def test_a_type_of_ros_1s_text_keeps_its_own_names() -> None:
    text = "Header header\nfloat64[] D\nfloat64[9] K\n"
    info_type: Any = TypeStore().message_from_text("sensor_msgs/CameraInfo", text)
    info = info_type(D=[1.0])
    assert array("d", [1.0]) == info_type.from_cdr(info.to_cdr()).D


def test_words_of_python_as_names() -> None:
    made = Written("int32 from\nint32 lambda\nint32 None\nint32 IN=5\nint32 in").module.It(
        1, 2, 3, 4
    )
    assert (made.from_, made.lambda_, made.None_, made.in_, made.IN) == (1, 2, 3, 4, 5)
    assert type(made).from_cdr(made.to_cdr()) == made


@pytest.mark.parametrize(
    "names",
    [
        ("data", "m", "p", "q", "k", "h", "e", "out", "b1", "n1", "self"),
        ("len", "type", "list", "range", "bytes", "map", "int", "texts", "flags", "numbers"),
        ("Header", "It", "Struct", "to_cdr", "serialize", "Any", "field", "array", "P"),
    ],
)
def test_names_of_fields_do_not_get_in_the_way(names: tuple[str, ...]) -> None:
    kinds = (
        "string",
        "float64[]",
        "uint8[]",
        "P[]",
        "string[]",
        "bool[]",
        "Q",
        "wstring",
        "int8[3]",
    )
    lines = [f"{kinds[i % len(kinds)]} {name}" for i, name in enumerate(names)]
    written = Written("\n".join(lines), P="string s\nfloat64 d", Q="float64 x")
    module = written.module
    module._plain = module._explain = None
    made = module.It()
    elements = {"P[]": module.P("a", 1.0), "string[]": "b", "bool[]": True}
    for line in lines:
        kind, _, name = line.partition(" ")
        if kind in elements:
            getattr(made, name).append(elements[kind])
    assert values.plain(module.It._decode(module.It._encode(made))) == values.plain(made)


def test_a_subclass_works_as_its_base() -> None:
    class Fast(Twist):
        def speed(self) -> float:
            return abs(self.linear.x)

    fast = Fast(Vector3(-2.0))
    assert fast.speed() == 2.0
    assert Twist.from_cdr(fast.to_cdr()) == Twist(Vector3(-2.0))
    assert Fast._slot_types == Twist._slot_types
    assert Fast.__slots__ == Twist.__slots__


def test_sizes() -> None:
    twist = Twist(Vector3(1.0, 2.0, 3.0), Vector3(4.0, 5.0, 6.0))
    parts = [twist, twist.linear, twist.angular, *[1.0] * 6]
    assert sum(map(sys.getsizeof, parts)) < 500


def test_every_class_describes_itself() -> None:
    store = TypeStore()
    for name in store.names("msg"):
        cls = store.message(name)
        assert cls._type == name
        assert cls._type_hash.startswith("RIHS01_")
        assert len(cls._md5sum) == 32
        assert len(cls._slot_types) == len(cls.__slots__)
        assert isinstance(repr(cls()), str)
        assert str(cls()) is not None
        assert issubclass(cls, Message)


IMPORT = """
import msgspec, sys, time
begin = time.process_time()  # other processes may keep the machine busy
import rosz.msgs.{}.msg
print(time.process_time() - begin)
assert not {{"yaml", "numpy", "zenoh", "rosz.idl"}} & set(sys.modules)
"""


@pytest.mark.parametrize("package", ["std_msgs", "sensor_msgs", "visualization_msgs"])
def test_importing_a_package_is_quick(package: str, tmp_path: Path) -> None:
    """The best of a few runs, after one that leaves its bytecode."""
    times = []
    for _ in range(6):
        done = subprocess.run(
            [sys.executable, "-c", IMPORT.format(package)],
            env={"PYTHONPATH": str(TOP), "PYTHONPYCACHEPREFIX": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        times.append(float(done.stdout))
    assert min(times[1:]) < 0.030


def test_stamps_are_ros_1_times() -> None:
    header = Header(0, Time(5, 0))
    assert (header.stamp - Time(3, 500_000_000)).to_sec() == 1.5
    assert header.stamp.secs == 5
    assert Duration(1, 0) + Duration(2, 0) == Duration(3, 0)
    assert Float64(header.stamp.to_sec()).data == 5.0


def test_none_is_the_default_header() -> None:
    header: Any = None
    assert PoseStamped(header).header == Header()
    assert PoseStamped(header=header).to_cdr() == PoseStamped().to_cdr()
