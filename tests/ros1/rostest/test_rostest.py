"""rostest and rosunit: tests that are nodes, and their result files."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from network import Network

from rosz.msgs.std_msgs.msg import String

SCRIPT = """
    import sys, unittest
    import rosz.ros1
    import rospy, rostest

    class TestTalker(unittest.TestCase):
        def test_there(self):
            rospy.init_node("test")
            self.assertTrue(rostest.is_publisher("chatter", "/talker"))
            self.assertFalse(rostest.is_subscriber("chatter", "/talker"))

        def test_answer(self):
            self.assertEqual(6 * 7, {answer})

    rostest.rosrun("talk", "test_talker", TestTalker, sys.argv)
    print("passed")
"""


def test_passing_test(network: Network) -> None:
    network.node("talker").publisher("chatter", String)
    file = network.folder / "out.xml"
    program = network.program(SCRIPT.format(answer=42), f"--gtest_output=xml:{file}")
    assert program.exit_code() == 0, program.output
    assert program.lines[-1] == "passed"
    suite = ET.parse(file).getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("2", "0", "0")
    assert [case.get("name") for case in suite] == ["test_answer", "test_there"]


def test_failing_test(network: Network) -> None:
    network.node("talker").publisher("chatter", String)
    program = network.program(SCRIPT.format(answer=41))
    assert program.exit_code() == 1
    assert "passed" not in program.lines
    (file,) = network.folder.rglob("rosunit-test_talker.xml")
    case = ET.parse(file).getroot().find("testcase[@name='test_answer']/failure")
    assert case is not None
    assert "42 != 41" in (case.text or "")
