"""The collection of tutorials: topics from launch files, own messages, publishers, a robot.

What of a line cannot be as it stands:

- ``source /opt/ros/noetic/setup.bash`` and ``/opt/ros/kinetic``: there is no such folder; ``rosz
  env`` has taken its place. Rosjects, the code editor and pictures are the site's own;
- ``rostopic list`` right after ``roscore``: ``/rosout`` comes with the first node, and
  ``/rosout_agg`` never, because no node gathers the log;
- the C++ of abc_qa, its compilation errors and ``catkin_make``'s output: the node is Python here;
- Gazebo: turtlebot3_sim stands in for it.
"""

from __future__ import annotations

import re

from .terminal import Desk, without_times

DRIVE = 300.0
"""Seconds: on a busy machine commands arrive late, and the robot drives in detours."""


def until(topic: str) -> str:
    """Return a line that waits for a topic, as a student does who types slowly."""
    return f"until rostopic list | grep -q {topic}; do sleep 0.1; done"


def test_publish_and_subscribe_from_launch_files(desk: Desk) -> None:
    """test_rostopic: rostopic as a node."""
    one, two = desk.terminal(), desk.terminal()
    assert one.type("cd src") == ""
    one.type("catkin_create_pkg test_rostopic")
    for line in ("cd test_rostopic", "mkdir launch", "cd launch", "touch test_pub.launch"):
        assert one.type(line) == ""
    made = desk.workspace / "src" / "test_rostopic"
    source = desk.course / "src" / "test_rostopic"
    for file in ("test_pub", "test_echo", "test_both"):
        (made / f"launch/{file}.launch").write_text((source / f"launch/{file}.launch").read_text())
    one.type("cd ~/catkin_ws")
    assert "0 errors" in one.type("catkin_make")
    assert one.type("source devel/setup.bash") == ""
    one.start("roslaunch test_rostopic test_pub.launch")
    one.wait_for("process[rostopic_pub_node-1]: started with pid")
    two.type(until("/test_topic"))
    two.start("roslaunch test_rostopic test_echo.launch")
    two.wait_for("---")
    output = without_times(two.interrupt())
    assert (
        'process[rostopic_echo_node-1]: started with pid [PID]\ndata: "Hello there!"\n---\n'
        in output
    )
    one.interrupt()
    one.start("roslaunch test_rostopic test_both.launch")
    one.wait_for('data: "Hello there!"')
    one.interrupt()


def test_custom_message_between_packages(desk: Desk) -> None:
    """quadrotor_receive has the message and the listener, transmit_thrust the talker."""
    desk.add("quadrotor_receive", "transmit_thrust")
    one, two = desk.terminal(), desk.terminal()
    for line in ("cd ~/catkin_ws", "source devel/setup.bash"):
        if line.startswith("source"):
            assert "0 errors" in one.type("catkin_make")
        assert one.type(line) == ""
    assert one.type("rosmsg show quadrotor_receive/Person") == "string name\nint32 age\n\n"
    one.start("rosrun quadrotor_receive custom_listener.py")
    two.start("rosrun transmit_thrust custom_talker.py")
    one.wait_for("ROS User is age: 4", 3)
    heard = without_times(one.interrupt()).replace("^C", "")
    assert set(heard.splitlines()) == {"[INFO] [TIME]: ROS User is age: 4"}
    said = without_times(two.interrupt())
    assert '[INFO] [TIME]: name: "ROS User"\nage: 4\n' in said
    assert "SyntaxWarning: The publisher should be created with an explicit keyword" in said


def test_who_publishes(desk: Desk) -> None:
    """help_msg: a topic, and the node behind it, whose name is not its file's."""
    desk.add("obiwan_pub.py")
    one, two, three = (desk.terminal() for _ in range(3))
    assert re.search(r"(?m)^\[1\] \d+$", one.type("nohup roscore &"))  # beside words of nohup
    one.type("cd ~/catkin_ws/src")
    one.start("./obiwan_pub.py")
    two.type(until("/help_msg"))
    assert two.type("rostopic list") == "/help_msg\n/rosout\n"
    info = two.type("rostopic info /help_msg")
    assert info.startswith("Type: std_msgs/String\n\nPublishers: \n * /sos_2 ")
    assert info.endswith("Subscribers: None\n\n\n")
    assert three.type("rostopic echo -n 1 /help_msg") == (
        'data: "help me Obi-Wan Kenobi, you\'re my only hope"\n---\n'
    )
    one.interrupt()
    one.type("kill %1")


def test_number_without_a_sound(desk: Desk) -> None:
    """abc_qa: nothing is shown, and yet it publishes; then it counts."""
    desk.add("abc_qa")
    one, two = desk.terminal(), desk.terminal()
    one.start("rosrun abc_qa abc_node")
    two.type(until("/abc_topic"))
    assert two.type("rostopic echo -n 2 /abc_topic") == "data: 0\n---\ndata: 0\n---\n"
    assert one.interrupt().replace("^C", "").strip() == ""
    one.start("rosrun abc_qa abc_node _increment:=1")
    two.type(until("/abc_topic"))
    values = [int(x) for x in re.findall(r"data: (\d+)", two.type("rostopic echo -n 3 /abc_topic"))]
    assert values == list(range(values[0], values[0] + 3))
    one.interrupt()


def test_waypoints(desk: Desk) -> None:
    """The ROS 2 tutorial: a robot driven from place to place by /odom and /cmd_vel."""
    desk.add("turtlebot3_waypoints")
    one, two = desk.terminal(), desk.terminal()
    one.start("roslaunch turtlebot3_gazebo turtlebot3_empty_world.launch real_time_factor:=2")
    one.wait_for("TurtleBot3 burger")
    driven = without_times(two.type("rosrun turtlebot3_waypoints waypoints.py", DRIVE))
    assert driven.splitlines() == [
        "[INFO] [TIME] [waypoints]: reached (0.5, 0.0)",
        "[INFO] [TIME] [waypoints]: reached (0.5, 0.5)",
        "[INFO] [TIME] [waypoints]: reached (0.0, 0.5)",
        "[INFO] [TIME] [waypoints]: reached (0.0, 0.0)",
        "[INFO] [TIME] [waypoints]: all places reached",
    ]
    assert 'frame_id: "odom"' in two.type("rostopic echo -n 1 /odom")
    assert two.type("rostopic type /cmd_vel") == "geometry_msgs/Twist\n"
    one.interrupt()


def test_waypoints_as_an_action(desk: Desk) -> None:
    """The same node as an action server of rclpy, for a client of actionlib."""
    desk.add("turtlebot3_waypoints")
    world, server, client = desk.terminal(), desk.terminal(), desk.terminal()
    world.start("roslaunch turtlebot3_gazebo turtlebot3_empty_world.launch real_time_factor:=5")
    world.wait_for("TurtleBot3 burger")
    server.start("rosrun turtlebot3_waypoints waypoint_server.py")
    server.wait_for("waiting for goals")
    driven = client.type("rosrun turtlebot3_waypoints waypoint_client.py", DRIVE)
    assert [line.partition("]: ")[2] for line in driven.splitlines()] == [
        "(0.5, 0.0): SUCCEEDED, near it: True",
        "(0.5, 0.5): SUCCEEDED, near it: True",
        "(0.0, 0.5): SUCCEEDED, near it: True",
        "(0.0, 0.0): SUCCEEDED, near it: True",
        "far away in 2 s: False",
        "PREEMPTED",
        "REJECTED",
    ]
    server.wait_for("took simulated time: True", times=4)
    server.interrupt()
    world.interrupt()
