"""smach and smach_ros: the programs here write on both sides what the files beside them hold.

Debian has no smach. The files were written with ROS 1's own, beside real rospy and actionlib.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from network import Network

PROGRAMS = Path(__file__).parent / "programs"


def test_containers() -> None:
    """What containers do, without a node."""
    found = subprocess.run(
        [sys.executable, "-m", "rosz.ros1", PROGRAMS / "containers.py"],
        check=False,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert found.returncode == 0, found.stderr
    assert found.stdout == (PROGRAMS / "containers.txt").read_text()


@pytest.mark.system
def test_states(network: Network) -> None:
    """What the states of smach_ros do, and introspection."""
    program = network.run("-m", "rosz.ros1", str(PROGRAMS / "states.py"))
    assert program.exit_code() == 0, program.output
    lines = [line for line in program.lines if line.startswith("= ")]
    assert lines == (PROGRAMS / "states.txt").read_text().splitlines()


@pytest.mark.system
def test_a_machine_ends_with_its_node(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rospy, smach, smach_ros
        class Wait(smach.State):
            def __init__(self):
                super().__init__(["preempted"])
            def execute(self, ud):
                print("waiting")
                while not self.preempt_requested():
                    rospy.sleep(0.01)
                self.service_preempt()
                print("preempted", rospy.is_shutdown())
                return "preempted"
        rospy.init_node("machine")
        sm = smach.StateMachine(["preempted"])
        with sm:
            smach.StateMachine.add("WAIT", Wait())
        smach_ros.set_preempt_handler(sm)
        import threading
        threading.Thread(target=sm.execute, daemon=True).start()
        rospy.spin()
        """
    )
    program.wait_for("waiting")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0, program.output
    assert "preempted False" in program.lines
