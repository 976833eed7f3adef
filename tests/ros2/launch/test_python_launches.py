"""Launch files in Python start programs, through both commands."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

from network import Network

from ros2.conftest import Ros2

LAUNCH = """
    from launch import LaunchDescription
    from launch.actions import DeclareLaunchArgument, ExecuteProcess, LogInfo
    from launch.substitutions import LaunchConfiguration
    from launch_ros.actions import Node

    def generate_launch_description():
        return LaunchDescription([
            DeclareLaunchArgument("rate", default_value="2.5", description="in Hz"),
            LogInfo(msg=["rate ", LaunchConfiguration("rate")]),
            Node(package="demo", executable="talker", name="left", namespace="arm", output="screen",
                 remappings=[("chatter", "/talk")], parameters=[
                     {"rate": LaunchConfiguration("rate"), "label": "1", "gains": {"p": [1, 2]}}]),
            Node(package="demo", executable="old.py", output="screen", parameters=[{"rate": 3}]),
            ExecuteProcess(cmd=["echo", "said", LaunchConfiguration("rate")], output="screen"),
        ])
"""
TALKER = """
    import rclpy
    from rclpy.node import Node
    from std_msgs.msg import String

    def main():
        rclpy.init()
        node = Node("talker")
        for name, default in (("rate", 0.0), ("label", ""), ("gains.p", [0])):
            node.declare_parameter(name, default)
        values = [node.get_parameter(name).value for name in ("rate", "label")]
        values.append(list(node.get_parameter("gains.p").value))
        topic = node.create_publisher(String, "chatter", 1).topic_name
        print(node.get_fully_qualified_name(), topic, *map(repr, values), flush=True)
"""
OLD = """\
#!/usr/bin/env python3
import sys
import rospy

rospy.init_node("old")
print(rospy.get_name(), rospy.get_param("~rate"), flush=True)
"""


def make_package(folder: Path) -> None:
    package = folder / "src" / "demo"
    for name, text in {
        "package.xml": "<package><name>demo</name></package>",
        "setup.py": "setup(entry_points={'console_scripts': ['talker = demo.talker:main']})",
        "demo/talker.py": TALKER,
        "scripts/old.py": OLD,
        "launch/demo.launch.py": LAUNCH,
    }.items():
        file = package / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dedent(text))
    (package / "scripts" / "old.py").chmod(0o755)


def test_nodes_get_their_names_parameters_and_remappings(network: Network) -> None:
    make_package(network.folder)
    path = str(network.folder / "src")
    words = ("-m", "rosz", "launch", "demo", "demo.launch.py", "rate:=4.0")
    launch = network.run(*words, ROSZ_PACKAGE_PATH=path)
    assert launch.exit_code() == 0, launch.output
    text = "\n".join(launch.lines)
    assert "/arm/left /talk 4.0 '1' [1, 2]" in text
    assert "/old 3" in text
    assert "rate 4.0" in launch.lines
    assert "said 4.0" in text


def test_ros2_launch_shows_arguments_and_errors(ros2: Ros2) -> None:
    make_package(ros2.network.folder)
    done = ros2("launch", "-s", "demo", "demo.launch.py")
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines()[2:] == ["    'rate':", "        in Hz", "        (default: '2.5')"]
    file = ros2.network.folder / "x.launch.py"
    file.write_text("import launch\n\nlaunch.Nothing()\n")
    done = ros2("launch", "x.launch.py")
    assert done.code == 1
    assert done.err.startswith("x.launch.py:3: AttributeError: module 'launch' of rosz has no")
    assert "Traceback" not in done.err
