"""genpy.dynamic: classes by the texts of their definitions."""

from __future__ import annotations

import io
from importlib import import_module
from typing import Any

import pytest

from rosz.errors import DefinitionError, EncodeError
from rosz.ros1 import install

install()
generate_dynamic: Any = import_module("genpy.dynamic").generate_dynamic

TEXT = f"""Header header
own_arm_msgs/Joint[] joints
byte state
{"=" * 80}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
{"=" * 80}
MSG: own_arm_msgs/Joint
byte MOVING=4
string name
float64[] position
"""


def test_each_type_in_a_text_has_a_class() -> None:
    found = generate_dynamic("own_arm_msgs/Arm", TEXT)
    assert set(found) == {"own_arm_msgs/Arm", "std_msgs/Header", "own_arm_msgs/Joint"}
    arm, joint = found["own_arm_msgs/Arm"], found["own_arm_msgs/Joint"]
    assert joint.MOVING == 4
    sent = arm(joints=[joint("elbow", [1.0, 2.0])], state=-3)
    out = io.BytesIO()
    sent.serialize(out)
    received = arm().deserialize(out.getvalue())
    assert received.joints[0].name == "elbow"
    assert received.joints[0].position == (1.0, 2.0)
    assert type(received.joints[0]) is joint
    assert received.state == -3


def test_a_class_of_a_text_checks_its_values() -> None:
    number = generate_dynamic("own_arm_msgs/Number", "int32 data\n")["own_arm_msgs/Number"]
    with pytest.raises(EncodeError, match="data"):
        number(data="1").serialize(io.BytesIO())


def test_a_text_with_an_unknown_type_is_an_error() -> None:
    with pytest.raises(DefinitionError, match="own_arm_msgs/Absent"):
        generate_dynamic("own_arm_msgs/Broken", "own_arm_msgs/Absent one\n")
