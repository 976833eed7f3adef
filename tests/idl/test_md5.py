"""ROS 1's hashes against those in the message modules that ROS 1 installs."""

from __future__ import annotations

import ast

import pytest
from oracle import MESSAGES

from rosz.idl import message_md5, parse_service, service_md5
from rosz.typestore import TypeStore

from .definitions import catalog_of

RULE = "=" * 80 + "\nMSG: "

# Pinned, as ROS 1 has known them for ever.
KNOWN = {
    "std_msgs/String": "992ce8a1687cec8c8bd883ec73ca41d1",
    "std_msgs/Header": "2176decaecbce78abc3b96ef049fabed",
    "std_msgs/Empty": "d41d8cd98f00b204e9800998ecf8427e",
    "std_msgs/Time": "cd7166c74c552c311fbcc2fe5a7bc289",
    "geometry_msgs/Twist": "9f195f881246fdfa2798d1d3eebca84a",
    "geometry_msgs/PoseStamped": "d3812c3cbc69362b77dc0b19b345f8f5",
    "geometry_msgs/TransformStamped": "b5764a33bfeb3588febc2682852579b0",
    "nav_msgs/Odometry": "cd5e73d190d741a2f92e81eda573aca7",
    "sensor_msgs/Image": "060021388200f6f0f447d0fcd9c64743",
    "sensor_msgs/LaserScan": "90c7ef2dc6895d81024acba2ac42f369",
    "sensor_msgs/JointState": "3066dcd76a6cfaef579bd0f34173e9fd",
    "sensor_msgs/PointCloud2": "1158d486dd51d683ce2f1be655c3c181",
    "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    # Of these ROS 2 has another text.
    "sensor_msgs/BatteryState": "4ddae7f048e32fda22cac764685e3974",
    "sensor_msgs/CameraInfo": "c9a58c1b0b154e0e6da7578cb991d214",
    "sensor_msgs/NavSatFix": "2d3a8cd499b9b4a0249fb98fd05cfa48",
    "sensor_msgs/Range": "c005c34273dc426c67a020a87bc24148",
    "shape_msgs/SolidPrimitive": "d8f8cbc74c5ff283fca29569ccefb45d",
    "stereo_msgs/DisparityImage": "04a177815f75271039fa21f16acad8c9",
    "visualization_msgs/ImageMarker": "1de93c67ec8858b831025a08fbf1b35c",
    "visualization_msgs/InteractiveMarkerUpdate": "710d308d0a9276d65945e92dd30b3946",
    "visualization_msgs/MarkerArray": "d155b9ce5188fbaf89745847fd5882d7",
}


@pytest.mark.parametrize(("name", "expected"), KNOWN.items())
def test_shipped_messages(name: str, expected: str) -> None:
    assert TypeStore().message(name)._md5sum == expected


def test_shipped_services() -> None:
    store = TypeStore()
    assert store.service("std_srvs/SetBool")._md5sum == "09fb03525b03e7ea1fd3992bafd87e16"
    assert store.service("sensor_msgs/SetCameraInfo")._md5sum == "bef1df590ed75ed1f393692395e15482"
    assert store.service("std_srvs/Empty")._md5sum == "d41d8cd98f00b204e9800998ecf8427e"
    assert store.service("rospy_tutorials/AddTwoInts")._md5sum == "6a2e34150c00229791cc89ff309fff21"


def test_rule() -> None:
    text = "# c\nint32 x 7\nuint8 A=007 # c\nstring S= a # b \n\nB[] b\ntime[] t\n"
    text += "builtin_interfaces/Duration d"
    ros1 = "uint8 A=007\nstring S=a # b\nint32 x\n{} b\ntime[] t\nduration d"
    catalog = catalog_of(
        {
            "p/msg/A": text,
            "p/msg/B": "",
            "builtin_interfaces/msg/Time": "int32 sec",
            "builtin_interfaces/msg/Duration": "int32 sec",
        }
    )
    from hashlib import md5

    inner = md5(b"").hexdigest()
    expected = md5(ros1.format(inner).encode()).hexdigest()
    assert message_md5(catalog.message("p/msg/A"), catalog) == expected


def installed() -> list[tuple[str, str, str]]:
    """Return the type, full text and hash of every message class that ROS 1 installed."""
    found = []
    for file in sorted(MESSAGES.glob("*/msg/_*.py")) + sorted(MESSAGES.glob("*/srv/_*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.ClassDef):
                continue
            values = {
                target.id: statement.value.value
                for statement in node.body
                if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)
                for target in statement.targets
                if isinstance(target, ast.Name)
            }
            if "_full_text" in values:
                names = ("_type", "_full_text", "_md5sum")
                name, text, md5 = (str(values[key]) for key in names)
                found.append((name, text, md5))
    return found


INSTALLED_TYPES = installed()


def full(name: str) -> str:
    return name if name.count("/") == 2 else name.replace("/", "/msg/")


@pytest.mark.ros1
@pytest.mark.skipif(not INSTALLED_TYPES, reason="needs Debian's ROS 1 message packages")
def test_every_installed_message() -> None:
    assert len(INSTALLED_TYPES) > 100
    for name, full_text, expected in INSTALLED_TYPES:
        own, *below = (full_text + "\n").split(RULE)
        texts = {full(name): own}
        for part in below:
            other, _, text = part.partition("\n")
            texts[full(other)] = text
        stamps = {"builtin_interfaces/msg/Time": "", "builtin_interfaces/msg/Duration": ""}
        catalog = catalog_of({**stamps, **texts})
        assert message_md5(catalog.message(full(name)), catalog) == expected, name


@pytest.mark.ros1
@pytest.mark.skipif(not INSTALLED_TYPES, reason="needs Debian's ROS 1 message packages")
def test_shipped_types_that_ros_1_has_too() -> None:
    """What both worlds have has ROS 1's hash, whatever ROS 2 made of its text."""
    store = TypeStore()
    messages, services = set(store.names("msg")), set(store.names("srv"))
    both = {
        name: (store.message(name) if name in messages else store.service(name), md5)
        for name, _, md5 in INSTALLED_TYPES
        if name in messages or name in services
    }
    assert len(both) > 100
    assert {name for name, (cls, md5) in both.items() if cls._md5sum != md5} == set()


def test_services_hash_both_halves() -> None:
    catalog = catalog_of({})
    spec = parse_service("p/srv/S", "int64 a\nint64 b\n---\nint64 sum")
    assert service_md5(spec, catalog) == "6a2e34150c00229791cc89ff309fff21"


def test_a_service_without_a_separator_has_an_empty_response() -> None:
    """As genmsg reads it, whose hash this is."""
    spec = parse_service("p/srv/S", "int32 a\nstring b\n")
    assert [field.name for field in spec.request.fields] == ["a", "b"]
    assert spec.response.fields == ()
    assert service_md5(spec, catalog_of({})) == "7675b1fd535f3a60bfd29044eacbc355"
