"""The lab on names, launch files, messages, services and parameters, with its package pub_sub.

The C++ nodes of the lab are Python here, of the same names. What of a line cannot be as it stands:

- the edits of ``CMakeLists.txt`` and ``package.xml`` change nothing: messages, services and
  ``.cfg`` files need no build; ``catkin_make`` checks them;
- ``launch-prefix="gnome-terminal -e"`` and ``terminator -x`` need a desktop;
- a type named ``pub_sub/Num.h`` and all else that is C++.
"""

from __future__ import annotations

import re

import pytest
from network import eventually

from .terminal import Desk, Terminal, without_times


def counts(output: str) -> list[int]:
    """Return the numbers that the subscriber counted."""
    return [int(found) for found in re.findall(r"I counted: \[(-?\d+)\]", output)]


def is_run(numbers: list[int]) -> bool:
    """Tell whether numbers follow one another."""
    return numbers == list(range(numbers[0], numbers[0] + len(numbers)))


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_pub_and_sub_launch(desk: Desk, version: int) -> None:
    """The launch file of each version: the publisher's output goes to its log."""
    desk.add_pub_sub(version)
    terminal = desk.terminal()
    assert "0 errors" in terminal.type("catkin_make")
    terminal.start("roslaunch pub_sub pub_and_sub.launch")
    terminal.wait_for("I counted", 5)
    output = without_times(terminal.interrupt())
    assert "    my_publisher (pub_sub/pub)\n    my_subscriber (pub_sub/sub)\n" in output
    assert "process[my_publisher-1]: started with pid [PID]\n" in output
    assert "process[my_subscriber-2]: started with pid [PID]\n" in output
    assert re.search(r"(?m)^\[INFO\] \[TIME\]: I counted: \[\d+\]$", output)
    assert is_run(counts(output))


def test_rosrun_and_names(desk: Desk) -> None:
    """Slides on names: nodes by rosrun, special keywords, remapped topics, namespaces."""
    desk.add_pub_sub(1)
    one, two, three = desk.terminal(), desk.terminal(), desk.terminal()
    one.start("rosrun pub_sub pub __name:=counter_1 counter:=/team/count")
    two.start("rosrun pub_sub sub __ns:=/team counter:=count")
    two.wait_for("I counted", 2)
    assert three.type("rosnode list") == "/counter_1\n/team/sub\n"
    assert three.type("rostopic list") == "/rosout\n/team/count\n"
    info = three.type("rostopic info /team/count")
    assert info.startswith("Type: std_msgs/Int64\n")
    assert "* /counter_1 " in info
    assert "* /team/sub " in info
    one.interrupt()
    two.interrupt()


def test_turtles_of_two_names(desk: Desk) -> None:
    """Slides on remapping: two turtlesims of other names, and a key that goes to the second."""
    terminals = [desk.terminal() for _ in range(3)]
    for number in (1, 2):
        terminals[number].start(f"rosrun turtlesim turtlesim_node __name:=turtlesim_{number}")
        terminals[number].wait_for("Spawning turtle")
    assert terminals[0].type("rosnode list") == "/turtlesim_1\n/turtlesim_2\n"
    terminals[1].interrupt()
    terminals[0].start("rosrun turtlesim turtle_teleop_key /turtle1/cmd_vel:=/turtle2/cmd_vel")
    terminals[0].wait_for("Use arrow keys")
    assert "/turtle2/cmd_vel" in terminals[1].type("rostopic list")
    terminals[2].interrupt()


def test_multi_turtle(desk: Desk) -> None:
    """The turtlesim example: what the first turtle is told, the second does, too."""
    package = desk.workspace / "src" / "turtle_pair"
    terminal, other = desk.terminal(), desk.terminal()
    terminal.type("cd src")
    terminal.type("catkin_create_pkg turtle_pair rospy")
    (package / "launch").mkdir(exist_ok=True)
    source = desk.course / "src" / "beginner_tutorials" / "launch" / "turtlemimic.launch"
    (package / "launch" / "multi_turtle.launch").write_text(source.read_text())
    terminal.start("roslaunch turtle_pair multi_turtle.launch")
    terminal.wait_for("process[mimic-3]: started")
    command = "geometry_msgs/Twist '[2.0, 0.0, 0.0]' '[0.0, 0.0, 1.8]'"
    other.start(f"rostopic pub -r 10 /turtlesim1/turtle1/cmd_vel {command}")
    third = desk.terminal()
    third.start("rostopic echo /turtlesim2/turtle1/cmd_vel")  # zeros until turtle1 moves
    third.wait_for(
        "linear: \n  x: 2.0\n  y: 0.0\n  z: 0.0\n"
        "angular: \n  x: 0.0\n  y: 0.0\n  z: 1.7999999523162842\n---\n"
    )
    third.interrupt()
    nodes = third.type("rosnode list").split()
    assert {"/mimic", "/turtlesim1/sim", "/turtlesim2/sim"} <= set(nodes)
    other.interrupt()
    terminal.interrupt()


def test_custom_message(desk: Desk) -> None:
    """pub_sub_v2: a message of one's own, made at the prompt."""
    desk.add_pub_sub(1)
    terminal = desk.terminal()
    terminal.type("cd ~/catkin_ws/src/pub_sub")
    assert terminal.type("mkdir msg") == ""
    assert terminal.type('echo "int64 num" > msg/Num.msg') == ""
    terminal.type("cd ~/catkin_ws")
    assert "0 errors" in terminal.type("catkin_make")
    assert terminal.type("rosmsg show pub_sub/Num") == "int64 num\n\n"


@pytest.fixture
def running(desk: Desk) -> Terminal:
    """A terminal in which pub_sub_v3 runs."""
    desk.add_pub_sub(3)
    terminal = desk.terminal()
    terminal.start("roslaunch pub_sub pub_and_sub.launch")
    terminal.wait_for("I counted", 3)
    return terminal


def test_service(desk: Desk, running: Terminal) -> None:
    """pub_sub_v3: a service, called at the prompt and by a node."""
    terminal = desk.terminal()
    assert terminal.type("rossrv show pub_sub/Reset") == (
        "int64 new_count\n---\nint64 old_count\n\n"
    )
    assert terminal.type("rosservice type /reset") == "pub_sub/Reset\n"
    answer = terminal.type("rosservice call /reset 0")
    assert re.fullmatch(r"old_count: \d+\n", answer)
    eventually(lambda: not is_run(counts(running.wait_for("I counted"))), "a count from 0 on")
    answer = without_times(terminal.type("rosrun pub_sub reset_client 1000"))
    assert re.fullmatch(r"\[INFO\] \[TIME\]: Old count: \d+\n", answer)
    running.wait_for("I counted: [1001]")
    usage = without_times(terminal.type("rosrun pub_sub reset_client"))
    assert usage == "[INFO] [TIME]: usage: client new_count\n"
    assert terminal.type("echo $?") == "1\n"
    running.interrupt()
    failed = without_times(terminal.type("rosrun pub_sub reset_client 1"))
    assert failed == "[ERROR] [TIME]: Failed to call service reset\n"


def test_static_parameter(desk: Desk) -> None:
    """pub_sub_v4: a parameter that is read once."""
    desk.add_pub_sub(4)
    one, two = desk.terminal(), desk.terminal()
    one.start("roslaunch pub_sub pub_and_sub.launch mode:=false")
    one.wait_for("I read", 3)
    assert two.type("rosparam get /mode") == "false\n"
    assert two.type("rosparam set /mode true") == ""
    so_far = one.wait_for("I read").count("I read")
    assert "I counted" not in one.wait_for("I read", so_far + 5)
    one.interrupt()


def test_dynamic_reconfigure(desk: Desk) -> None:
    """pub_sub_v5: the same, and the form of texts, while the node runs."""
    desk.add_pub_sub(5)
    one, two = desk.terminal(), desk.terminal()
    assert "0 errors" in two.type("catkin_make")
    one.start("roslaunch pub_sub pub_and_sub.launch")
    one.wait_for("Reconfigure request: mode=True fmt=0")
    one.wait_for("I counted", 2)
    two.type("rosservice call /reset 200000")
    two.type("rosrun dynamic_reconfigure dynparam set /my_publisher mode false")
    one.wait_for("Reconfigure request: mode=False fmt=0")
    one.wait_for("I read: [200")
    two.type("rosrun dynamic_reconfigure dynparam set /my_publisher fmt 1")
    one.wait_for("Reconfigure request: mode=False fmt=1")
    two.type("rosservice call /reset 4096")
    one.wait_for("I read: [1000]")
    assert two.type("rosparam get /my_publisher/fmt") == "1\n"
    shown = two.type("rosrun dynamic_reconfigure dynparam get /my_publisher")
    assert "'mode': False" in shown
    assert "'fmt': 1" in shown
    one.interrupt()


def test_timers(desk: Desk) -> None:
    """pub_sub_v6: a timer counts, and one of a single shot tells about it."""
    desk.add_pub_sub(6)
    terminal = desk.terminal()
    terminal.start("roslaunch pub_sub pub_and_sub.launch")
    terminal.wait_for("Counting since")
    output = terminal.interrupt()
    assert re.search(r"Counting since [1-9]\d* s", output)
    assert is_run(counts(output))
    assert output.count("Counting since") == 1
