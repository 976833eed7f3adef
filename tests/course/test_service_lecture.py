"""The lecture on services, launch files and parameters, with package beginner_tutorials.

What of a line cannot be as it stands:

- ``rosrun rqt_graph rqt_graph`` and ``rqt_graph`` open a page in place of a window;
- ``rosparam list`` without a core: ``ERROR: Unable to communicate with master!`` is not said, there
  is no master; it prints what there is, which is nothing;
- ``/rosdistro: kinetic``: other values; ``/roslaunch/uris/…`` comes with a launch, not with a core;
- ``/rosout/get_loggers``: there is no node rosout;
- ``rosrun beginner_tutorials turtlemimic.launch`` is a slip for ``roslaunch``;
- ``rosparam -h`` names the same commands in other words;
- stereo_camera, openni_launch_marvin and marvin_cameras: packages that nobody has; the forms of
  their lines are those of example_param_pkg and turtlemimic.
"""

from __future__ import annotations

import re

from .terminal import Desk, without_times


def test_talker_and_listener(desk: Desk) -> None:
    """The recap: one shell for each of roscore, talker and listener."""
    desk.add("beginner_tutorials")
    one, two, three = (desk.terminal() for _ in range(3))
    assert "0 errors" in two.type("catkin_make")
    one.start("roscore")
    one.wait_for("started core")
    two.start("rosrun beginner_tutorials talker.py")
    three.start("rosrun beginner_tutorials listener.py")
    three.wait_for("I heard hello world", 3)
    heard = without_times(three.interrupt()).replace("^C", "").splitlines()
    said = without_times(two.interrupt()).splitlines()
    for line in heard:
        assert re.fullmatch(r"\[INFO\] \[TIME\]: I heard hello world \d+\.\d+", line)
        assert line.replace("I heard ", "") in said


def test_add_two_ints(desk: Desk) -> None:
    """A service of one's own, from its file to its answer."""
    desk.add("beginner_tutorials")
    one, two = desk.terminal(), desk.terminal()
    assert two.type("roscd beginner_tutorials") == ""
    assert two.type("pwd") == f"{desk.workspace}/src/beginner_tutorials\n"
    assert two.type("rm -r srv") == ""
    write = r"printf 'int64 a\nint64 b\n---\nint64 sum\n' > AddTwoInts.srv"
    for line in ("mkdir srv", "cd srv", write):
        assert two.type(line) == ""
    assert "AddTwoInts.srv" in two.type("rosls beginner_tutorials/srv")
    assert two.type("rossrv show beginner_tutorials/AddTwoInts") == (
        "int64 a\nint64 b\n---\nint64 sum\n\n"
    )
    one.start("rosrun beginner_tutorials add_two_ints_server.py")
    one.wait_for("Ready to add two ints.")
    assert two.type("rosrun beginner_tutorials add_two_ints_client.py 1 3") == (
        "Requesting 1+3\n1 + 3 = 4\n"
    )
    assert two.type("rosservice call /add_two_ints 1 2") == "sum: 3\n"
    assert two.type("rosservice args /add_two_ints") == "a b\n"
    assert two.type("rosrun beginner_tutorials add_two_ints_client.py") == (
        "add_two_ints_client.py [x y]\n"
    )
    one.wait_for("Returning [1 + 2 = 3]")
    output = one.interrupt().replace("^C", "")
    assert output == "Ready to add two ints.\nReturning [1 + 3 = 4]\nReturning [1 + 2 = 3]\n"


def test_services_of_turtlesim(desk: Desk) -> None:
    """rosservice and rossrv beside a turtle."""
    one, two = desk.terminal(), desk.terminal()
    one.start("rosrun turtlesim turtlesim_node")
    one.wait_for("Spawning turtle")
    assert {
        "/clear",
        "/kill",
        "/reset",
        "/spawn",
        "/turtle1/set_pen",
        "/turtle1/teleport_absolute",
        "/turtle1/teleport_relative",
    } <= set(two.type("rosservice list").split())
    assert two.type("rosservice type /spawn") == "turtlesim/Spawn\n"
    assert two.type("rosservice type /spawn | rossrv info") == (
        "float32 x\nfloat32 y\nfloat32 theta\nstring name\n---\nstring name\n\n"
    )
    assert two.type("rosservice call /spawn 5 4 0.8 'new_turtle'") == 'name: "new_turtle"\n'
    one.wait_for("Spawning turtle [new_turtle] at x=[5.000000], y=[4.000000], theta=[0.800000]")


def test_turtlemimic(desk: Desk) -> None:
    """The launch file of the lecture, and the line that drives both turtles."""
    desk.add("beginner_tutorials")
    one, two, three = (desk.terminal() for _ in range(3))
    one.start("roslaunch beginner_tutorials turtlemimic.launch")
    one.wait_for("process[mimic-3]: started")
    two.start(
        "rostopic pub /turtlesim1/turtle1/cmd_vel geometry_msgs/Twist -r 1"
        " -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, -1.8]'"
    )
    turning = "angular_velocity: -1.7999999523162842"
    for number in (1, 2):
        three.start(f"rostopic echo /turtlesim{number}/turtle1/pose")
        three.wait_for(turning)
        three.interrupt()
    one.interrupt()


def test_two_turtles_in_one_namespace(desk: Desk) -> None:
    """The exercise behind it."""
    desk.add("beginner_tutorials")
    one, two, three = (desk.terminal() for _ in range(3))
    one.start("roslaunch beginner_tutorials turtlemimic_one_namespace.launch")
    one.wait_for("process[turtlesim1/mimic-3]: started")
    two.start(
        "rostopic pub /turtlesim1/turtle1/cmd_vel geometry_msgs/Twist -r 1"
        " -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, -1.8]'"
    )
    three.start("rostopic echo /turtlesim1/turtle2/pose")
    three.wait_for("linear_velocity: 2.0")
    three.interrupt()
    one.interrupt()


def test_parameters_at_the_prompt(desk: Desk) -> None:
    """rosparam without a core, with one, and a parameter of one's own."""
    one, two = desk.terminal(), desk.terminal()
    assert "Traceback" not in two.type("rosparam list")
    one.start("roscore")
    one.wait_for("started core")
    assert two.type("rosparam list") == "/rosdistro\n/rosversion\n/run_id\n"
    assert two.type('rosparam set /our_own_param "learning ROS params"') == ""
    assert two.type("rosparam list") == "/our_own_param\n/rosdistro\n/rosversion\n/run_id\n"
    assert two.type("rosparam get /our_own_param") == "learning ROS params\n"
    usage = two.type("rosparam -h")
    for command in ("set", "get", "load", "dump", "delete", "list"):
        assert re.search(rf"(?m)^  rosparam {command} ", usage)
    for line in ("my_integer 7", "my_float 3.14", 'my_string "hello"'):
        assert two.type(f"rosparam set {line}") == ""
    assert two.type("rosparam list").startswith("/my_float\n/my_integer\n/my_string\n")


def test_parameters_in_a_node(desk: Desk) -> None:
    """Parameters by rospy and by the module rosparam, from a launch file."""
    desk.add("beginner_tutorials")
    terminal = desk.terminal()
    terminal.start("roslaunch beginner_tutorials test_params.launch")
    terminal.wait_for("finished cleanly")
    lines = terminal.interrupt().splitlines()
    start = lines.index("Int: 7, Float: 3.14, String: hello")
    assert lines[start + 1 : start + 8] == [
        "12 this is a default value",
        "1 [1.0, 2.0, 3.0, 4.0] True",
        "2 [('d', 3), ('i', 2), ('p', 1)]",
        "1 [1.0, 2.0, 3.0, 4.0] True",
        "2 [('d', 3), ('i', 2), ('p', 1)]",
        "value not set",
        "True",
    ]
    assert lines[start + 8 : start + 10] == [
        "/global_example top",
        "/node_name/global_example",
    ]
