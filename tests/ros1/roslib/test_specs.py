"""roslib.msgs, roslib.srvs and roslib.gentools: specs, md5 and full texts of definitions."""

from __future__ import annotations

from pathlib import Path

import pytest
from oracle import ours, real

from rosz.ros1.genpy import get_message_class, get_service_class
from rosz.ros1.roslib import gentools, msgs, srvs
from rosz.ros1.roslib.msgs import MsgSpecException

_PACKAGES = ("actionlib_msgs", "geometry_msgs", "sensor_msgs", "std_msgs", "visualization_msgs")

_SPECS = """
from roslib import msgs, srvs
result = []
for text in (
    "int8 A=-3\\n# a comment\\nstring B = two  # three\\nHeader header\\nfloat32[3] c\\nPoint[] d",
    "bool T=True\\nchar C=7\\ntime a\\nduration[] b\\ngeometry_msgs/Pose pose",
    "int32 a\\nint32 a",
    "int32 a b",
    "int8 A=300",
    "Foo A=1",
    "",
):
    for package in ("", "geometry_msgs"):
        try:
            spec = msgs.load_from_string(text, package, "geometry_msgs/X", "X")
        except msgs.MsgSpecException as error:
            result.append("refused")
            continue
        constants = [[one.type, one.name, one.val, one.val_text] for one in spec.constants]
        result.append([spec.types, spec.names, constants, spec.has_header(), repr(spec)])
service = srvs.load_from_string("int32 a\\n---\\nint32 b  # c", "p", "p/S", "S")
result.append([service.request.names, service.response.full_name, repr(service)])
"""


@pytest.mark.parametrize("package", _PACKAGES)
def test_md5_of_all_types_of_a_package(package: str) -> None:
    for name in msgs.list_msg_types(package, include_depends=False):
        full, spec = msgs.load_by_type(name, package)
        needed = gentools.get_dependencies(spec, package)
        cls = get_message_class(full)
        assert cls is not None
        assert gentools.compute_md5(needed) == cls._md5sum, full
        assert all(Path(file).is_file() for file in needed["files"].values())


def test_a_service_in_a_file() -> None:
    file = srvs.srv_file("std_srvs", "SetBool")
    name, spec = srvs.load_from_file(file, "std_srvs/")
    assert name == "std_srvs/SetBool"
    needed = gentools.get_file_dependencies(file)
    cls = get_service_class(name)
    assert cls is not None
    assert gentools.compute_md5(needed) == cls._md5sum
    assert spec.request.fields() == [("bool", "data")]
    assert ("std_srvs/SetBool", spec) in srvs.get_pkg_srv_specs("std_srvs")[0]


@pytest.mark.ros1
def test_specs_are_those_of_roslib() -> None:
    assert ours(_SPECS) == real(_SPECS, "roslib.msgs", "python3-roslib")


def test_full_text_has_each_type_once() -> None:
    _, spec = msgs.load_by_type("PoseStamped", "geometry_msgs")
    text = gentools.compute_full_text(gentools.get_dependencies(spec, "geometry_msgs"))
    assert [line for line in text.splitlines() if line.startswith("MSG: ")] == [
        "MSG: std_msgs/Header",
        "MSG: geometry_msgs/Pose",
        "MSG: geometry_msgs/Point",
        "MSG: geometry_msgs/Quaternion",
    ]
    assert "uint32 seq\ntime stamp\n" in text


def test_unknown_types() -> None:
    with pytest.raises(MsgSpecException, match="std_msgs/Nothing"):
        msgs.load_by_type("std_msgs/Nothing")
    spec = msgs.load_from_string("no_such_package/Type a", "std_msgs")
    with pytest.raises(MsgSpecException, match="no_such_package"):
        gentools.get_dependencies(spec, "std_msgs")
    with pytest.raises(MsgSpecException, match="message or service"):
        srvs.parts_of("spec")
