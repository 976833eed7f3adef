"""rosidl_runtime_py, as programs use it: messages as text, filled from values, found by name."""

from __future__ import annotations

import pytest
from network import Network

from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.std_msgs.msg import Int32MultiArray, String
from rosz.ros2 import rosidl_runtime_py as runtime


def test_text_of_messages() -> None:
    message = Int32MultiArray(data=[1, 2, 3])
    assert runtime.message_to_yaml(message).endswith("data:\n- 1\n- 2\n- 3\n")
    assert runtime.message_to_yaml(message, truncate_length=1).endswith("- 1\n- '...'\n")
    assert "<sequence type: int32, length: 3>" in runtime.message_to_yaml(message, no_arr=True)
    assert runtime.message_to_yaml(message, flow_style=True).endswith("data: [1, 2, 3]\n")
    assert runtime.message_to_csv(String(data="long text"), truncate_length=4) == "long..."
    assert runtime.message_to_ordereddict(String(data="x")) == {"data": "x"}
    assert runtime.message_to_ordereddict(String("x"), no_str=True)["data"].endswith("<1>>")


def test_fields_from_values() -> None:
    message = PoseStamped()
    values = {"header": "auto", "pose": {"position": {"x": "1.5"}}}
    (stamp,) = runtime.set_message_fields(message, values, expand_header_auto=True)
    stamp.sec = 7
    assert (message.header.stamp.sec, message.pose.position.x) == (7, 1.5)
    with pytest.raises(AttributeError, match="'PoseStamped' object has no attribute 'place'"):
        runtime.set_message_fields(message, {"place": 1})
    with pytest.raises(TypeError, match="expected to be a dictionary but is a str"):
        runtime.set_message_fields(message, {"header": "auto"})


def test_classes_by_name(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        from rosidl_runtime_py.convert import message_to_yaml
        from rosidl_runtime_py.utilities import get_interface, get_message, get_service
        from std_msgs.msg import String
        assert get_message("std_msgs/msg/String") is String
        assert get_service("std_srvs/srv/SetBool").Request
        assert get_interface("example_interfaces/action/Fibonacci").Goal
        print(message_to_yaml(String(data="x")), end="")
        for name in ("std_msgs/String", "absent_msgs/msg/X", "std_msgs/msg/Absent"):
            try:
                get_message(name)
            except (ValueError, ImportError, AttributeError) as error:
                print(type(error).__name__)
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["data: x", "ValueError", "ModuleNotFoundError", "AttributeError"]
