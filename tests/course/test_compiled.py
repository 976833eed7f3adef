"""The lab's package pub_sub in C++, as it is printed, beside Python nodes of the same package."""

from __future__ import annotations

import re
import shutil

import pytest
from bridges.ros1.world import roscpp
from network import free_port

from .terminal import COURSE, Desk, without_times
from .test_names_lab import counts, is_run

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_SLOW = 60.0


@pytest.fixture
def compiled(desk: Desk) -> Desk:
    """A desk where the nodes of pub_sub are compiled, as catkin_make would leave them."""
    package = COURSE / "pub_sub" / "v3"
    program = roscpp("pub_sub", folder=COURSE / "compiled", interfaces=package)
    desk.add_pub_sub(3)
    devel = desk.workspace / "devel"
    (devel / "lib" / "pub_sub").mkdir(parents=True)
    (devel / ".catkin").write_text(str(desk.workspace / "src"))
    scripts = desk.workspace / "src" / "pub_sub" / "scripts"
    (scripts / "sub").rename(scripts / "sub.py")
    (scripts / "pub").unlink()
    for name in ("pub", "sub", "client"):
        shutil.copy(program, devel / "lib" / "pub_sub" / name)
    desk.variables["ROS_IP"] = "127.0.0.1"
    desk.variables["ROS_MASTER_URI"] = f"http://127.0.0.1:{free_port()}"
    return desk


def test_compiled_nodes_run_as_printed(compiled: Desk) -> None:
    """The launch file of the lab, its service by command line and by a client, and rospy nodes."""
    core, one, two, three = (compiled.terminal() for _ in range(4))
    core.start(f"rosz core --ros1 --port {compiled.variables['ROS_MASTER_URI'].split(':')[-1]}")
    core.wait_for("started core", 1, _SLOW)
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
