"""Compare names, types, order, bounds and constants with what rosbags knows of ROS 2 and ROS 1."""

import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .definitions import DEFINITIONS, Definition

JAZZY = get_typestore(Stores.ROS2_JAZZY).fielddefs
# Types that later releases have added; those that they have changed are Jazzy's here.
ROS2 = get_typestore(Stores.ROS2_LYRICAL).fielddefs | JAZZY
NOETIC = get_typestore(Stores.ROS1_NOETIC).fielddefs
PACKAGES = {definition.package for definition in DEFINITIONS}
MESSAGES = {str(item): item for item in DEFINITIONS if item.kind == "msg"}

# ROS 2 gives a message without fields this one on the wire; rosbags stores it, a text has it not.
EMPTY = [("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))]

# Known neither to rosbags' stores of ROS 2 nor to its Noetic one; test_definition_hashes pins them.
UNKNOWN = {
    "example_interfaces",
    "geographic_msgs",
    "map_msgs",
    "move_base_msgs",
    "rosapi",
    "rospy_tutorials",
    "rosserial_msgs",
    "smach_msgs",
    "tf",
    "tf2_web_republisher",
    "turtlesim",
}

# rosbags keeps no default values: every field that has one, as in Jazzy.
DEFAULTS = {
    ("geometry_msgs/msg/Quaternion", "x"): "0",
    ("geometry_msgs/msg/Quaternion", "y"): "0",
    ("geometry_msgs/msg/Quaternion", "z"): "0",
    ("geometry_msgs/msg/Quaternion", "w"): "1",
    ("rcl_interfaces/msg/ParameterDescriptor", "read_only"): "false",
    ("rcl_interfaces/msg/ParameterDescriptor", "dynamic_typing"): "false",
    ("sensor_msgs/msg/NavSatStatus", "status"): "-2",
    ("type_description_interfaces/msg/FieldType", "type_id"): "0",
    ("type_description_interfaces/srv/GetTypeDescription", "include_type_sources"): "true",
}


@pytest.mark.parametrize("name", [name for name in ROS2 if name.split("/")[0] in PACKAGES])
def test_every_type_of_ros2_is_there_and_equal(name: str) -> None:
    constants, fields = get_types_from_msg(MESSAGES[name].text, name)[name]
    assert (constants, fields or EMPTY) == ROS2[name]


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in NOETIC
        if name not in ROS2
        and name.split("/")[0] in PACKAGES - {"actionlib"}  # messages that come of actions
    ],
)
def test_every_type_of_ros_1_that_jazzy_dropped_is_there_and_equal(name: str) -> None:
    constants, fields = get_types_from_msg(MESSAGES[name].text, name)[name]
    assert (constants, fields or EMPTY) == NOETIC[name]


def test_types_that_rosbags_does_not_know_belong_to_the_packages_listed() -> None:
    unknown = {name.split("/")[0] for name in MESSAGES if name not in ROS2 and name not in NOETIC}
    assert unknown == UNKNOWN


@pytest.mark.parametrize("definition", DEFINITIONS, ids=str)
def test_rosbags_reads_every_section(definition: Definition) -> None:
    for section in definition.sections:
        types = get_types_from_msg(section.text, "some_msgs/msg/Section")
        constants, fields = types["some_msgs/msg/Section"]
        assert [name for name, _ in fields] == [field.name for field in section.fields]
        assert len(constants) == len(section.lines) - len(section.fields)


def test_defaults_are_those_of_jazzy() -> None:
    found = {
        (str(definition), field.name): field.default
        for definition in DEFINITIONS
        for section in definition.sections
        for field in section.fields
        if field.default
    }
    assert found == DEFAULTS
