"""The C++ programs of the course, as they are printed, beside Python nodes."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from bridges.ros1.world import roscpp
from network import free_port

from .terminal import COURSE, Desk, without_times
from .test_names_lab import counts, is_run

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_SLOW = 60.0


@pytest.fixture(scope="module")
def program() -> str:
    """A program that is all nodes, each where its file has the name of it."""
    package = COURSE / "pub_sub" / "v5"
    return roscpp("pub_sub", "dynamic_reconfigure", folder=COURSE / "compiled", interfaces=package)


@pytest.fixture
def compiled(desk: Desk) -> Desk:
    """A desk with an address for a master of ROS 1, and a devel space."""
    devel = desk.workspace / "devel"
    devel.mkdir()
    (devel / ".catkin").write_text(str(desk.workspace / "src"))
    desk.variables["ROS_IP"] = "127.0.0.1"
    desk.variables["ROS_MASTER_URI"] = f"http://127.0.0.1:{free_port()}"
    return desk


def _build(desk: Desk, program: str, package: str, **nodes: str) -> Path:
    """Leave nodes as catkin_make would, under names of their own; return the package."""
    made = desk.workspace / "devel" / "lib" / package
    made.mkdir(parents=True)
    for name, node in nodes.items():
        shutil.copy(program, made / node)
        if name != node:
            (made / name).symlink_to(made / node)
    return desk.workspace / "src" / package


def _start_core(desk: Desk) -> None:
    core = desk.terminal()
    core.start(f"rosz core --ros1 --port {desk.variables['ROS_MASTER_URI'].split(':')[-1]}")
    core.wait_for("started core", 1, _SLOW)


def test_compiled_nodes_run_as_printed(compiled: Desk, program: str) -> None:
    """The launch file of the lab, its service by command line and by a client, and rospy nodes."""
    compiled.add_pub_sub(3)
    package = _build(compiled, program, "pub_sub", pub="pub", sub="sub", client="client")
    (package / "scripts" / "sub").rename(package / "scripts" / "sub.py")
    (package / "scripts" / "pub").unlink()
    one, two, three = (compiled.terminal() for _ in range(3))
    _start_core(compiled)
    one.start("roslaunch pub_sub pub_and_sub.launch")
    one.wait_for("I counted", 5, _SLOW)
    two.start("rosrun pub_sub sub.py")
    two.wait_for("I counted", 5, _SLOW)
    told = three.type("rosrun pub_sub client 1000000", _SLOW)
    assert re.search(r"\[ INFO\] \[TIME\]: Old count: \d+", without_times(told))
    two.wait_for("I counted: [1000001]", 1, _SLOW)
    one.wait_for("I counted: [1000001]", 1, _SLOW)
    assert int(three.type("rosservice call /reset 0", _SLOW).split()[1]) > 1000000
    assert is_run([number for number in counts(two.interrupt()) if 0 < number < 1000000][:5])
    output = one.interrupt()
    assert is_run(counts(output)[:5])
    assert re.search(
        r"(?m)^(\x1b\[0m)?\[ INFO\] \[TIME\]: I counted: \[\d+\]$", without_times(output)
    )
    assert "process[my_publisher-1]: started with pid [PID]\n" in without_times(output)


def test_a_static_parameter_of_a_compiled_node(compiled: Desk, program: str) -> None:
    """pub_sub_v4: the node looks at it before its main loop."""
    compiled.add_pub_sub(4)
    package = _build(compiled, program, "pub_sub", pub="static_pub")
    (package / "scripts" / "pub").unlink()
    one, two = compiled.terminal(), compiled.terminal()
    one.start("roslaunch pub_sub pub_and_sub.launch mode:=false")
    one.wait_for("I read", 3, _SLOW)
    assert two.type("rosparam get /mode", _SLOW) == "false\n"
    assert two.type("rosparam set /mode true", _SLOW) == ""
    so_far = one.wait_for("I read").count("I read")
    assert "I counted" not in one.wait_for("I read", so_far + 5, _SLOW)
    one.interrupt()


def test_dynamic_reconfigure_of_a_compiled_node(compiled: Desk, program: str) -> None:
    """pub_sub_v5: the server of the lab, with the header that Debian makes of the .cfg file."""
    compiled.add_pub_sub(5)
    package = _build(compiled, program, "pub_sub", pub="dynamic_pub")
    (package / "scripts" / "pub").unlink()
    one, two = compiled.terminal(), compiled.terminal()
    one.start("roslaunch pub_sub pub_and_sub.launch")
    one.wait_for("Reconfigure request: mode=True fmt=0", 1, _SLOW)
    one.wait_for("I counted", 2, _SLOW)
    for setting, expected in (
        ("mode false", "mode=False fmt=0 level=1"),
        ("fmt 1", "mode=False fmt=1 level=2"),
    ):
        two.type(f"rosrun dynamic_reconfigure dynparam set /my_publisher {setting}", _SLOW)
        one.wait_for(f"Reconfigure request: {expected}", 1, _SLOW)
    one.wait_for("I read", 1, _SLOW)
    assert two.type("rosparam get /my_publisher/fmt", _SLOW) == "1\n"
    one.interrupt()


def test_the_corrected_publisher(compiled: Desk, program: str) -> None:
    """abc_qa: without a master there is an error; then nothing is shown, and yet it publishes."""
    compiled.add("abc_qa")
    package = _build(compiled, program, "abc_qa", abc_node="abc_node")
    (package / "src" / "abc_node").unlink()
    one, two = compiled.terminal(), compiled.terminal()
    one.start("rosrun abc_qa abc_node &")
    one.wait_for("start 'rosz core --ros1' on that machine", 1, _SLOW)
    one.wait_for("Failed to contact master", 1, _SLOW)
    _start_core(compiled)
    assert two.type("rostopic echo -n 2 /abc_topic", _SLOW) == "data: 0\n---\ndata: 0\n---\n"
    # Its loop never ends, as it is printed. The shell does not always say that a job was killed.
    one.start("kill -9 %1; wait %1; echo status $?")
    one.wait_for("status 137", 1, _SLOW)
