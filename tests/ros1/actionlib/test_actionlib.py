"""actionlib: goals, results, feedback and preemption between programs."""

from __future__ import annotations

from pathlib import Path

import pytest
from network import Network
from oracle import ours as in_rosz
from oracle import real

from rosz.environment import Environment, package_index
from rosz.typestore import TypeStore

PROGRAMS = Path(__file__).parent / "programs"
ACTION = "# what to count to\nint32 top\n---\nint32 sum\n---\nint32 now\n"

SERVER = """
    import rosz.ros1
    import actionlib, rospy
    from counting.msg import CountAction, CountFeedback, CountResult

    def execute(goal):
        if goal.top < 0:
            raise ValueError("below nothing")
        if goal.top == 0:
            return
        total = 0
        for number in range(1, goal.top + 1):
            if server.is_preempt_requested():
                server.set_preempted(CountResult(total), "interrupted")
                return
            total += number
            server.publish_feedback(CountFeedback(number))
            # A result may overtake feedback, which is then ignored.
            while rospy.get_param("/taken", 0) < number and not server.is_preempt_requested():
                rospy.sleep(0.01)
        server.set_succeeded(CountResult(total), "counted")

    rospy.init_node("server")
    server = actionlib.SimpleActionServer("count/", CountAction, execute, auto_start=False)
    server.start()
    print("ready", flush=True)
    rospy.spin()
"""

CLIENT = """
    import rosz.ros1
    import actionlib, rospy
    from actionlib_msgs.msg import GoalStatus
    from counting.msg import CountAction, CountGoal
    rospy.init_node("client")
    client = actionlib.SimpleActionClient("//count", CountAction)  # rospy tidies names
    assert client.wait_for_server(rospy.Duration(60))
"""


@pytest.fixture
def path(network: Network) -> str:
    """A package path with a package that has an action."""
    folder = network.folder / "src" / "counting"
    (folder / "action").mkdir(parents=True)
    (folder / "action" / "Count.action").write_text(ACTION)
    (folder / "package.xml").write_text("<package><name>counting</name></package>")
    return str(folder.parent)


def test_goals(network: Network, path: str) -> None:
    network.program(SERVER, ROSZ_PACKAGE_PATH=path).wait_for("ready")
    client = network.program(
        CLIENT
        + """
    heard = []
    def take(feedback):
        heard.append(feedback.now)
        rospy.set_param("/taken", feedback.now)
    client.send_goal(
        CountGoal(4),
        done_cb=lambda state, result: heard.append(("done", state, result.sum)),
        active_cb=lambda: heard.append("active"),
        feedback_cb=take,
    )
    print(client.wait_for_result(rospy.Duration(60)), client.get_state(), client.get_result().sum,
          client.get_goal_status_text(), client.simple_state)
    print(sorted(heard, key=str))
    print(client.send_goal_and_wait(CountGoal(-1), rospy.Duration(60)),
          client.get_goal_status_text())
    print(client.send_goal_and_wait(CountGoal(0), rospy.Duration(60)),
          client.get_goal_status_text())
    print(client.send_goal_and_wait(CountGoal(100000), rospy.Duration(0.2), rospy.Duration(60)),
          client.get_goal_status_text())
""",
        ROSZ_PACKAGE_PATH=path,
    )
    assert client.exit_code() == 0, client.output
    assert client.lines == [
        "True 3 10 counted 2",
        "[('done', 3, 10), 1, 2, 3, 4, 'active']",
        "4 Exception in execute callback: below nothing",
        "4 No terminal state was set.",
        "2 interrupted",
    ]


def test_a_newer_goal_preempts(network: Network, path: str) -> None:
    network.program(SERVER, ROSZ_PACKAGE_PATH=path).wait_for("ready")
    first = network.program(
        CLIENT
        + """
    client.send_goal(CountGoal(100000), active_cb=lambda: print("active", flush=True))
    client.wait_for_result()
    print(client.get_state(), client.get_result().sum > 0)
""",
        ROSZ_PACKAGE_PATH=path,
    )
    first.wait_for("active")
    second = network.program(
        CLIENT
        + """
    rospy.set_param("/taken", 3)
    print(client.send_goal_and_wait(CountGoal(3)), client.get_result().sum)
""",
        "__name:=second",
        ROSZ_PACKAGE_PATH=path,
    )
    assert second.exit_code() == 0, second.output
    assert second.lines == ["3 6"]
    assert first.exit_code() == 0, first.output
    assert first.lines == ["active", "2 True"]


def test_goal_callbacks(network: Network, path: str) -> None:
    program = network.program(
        """
        import rosz.ros1
        import actionlib, rospy, threading
        from counting.msg import CountAction, CountGoal, CountResult
        rospy.init_node("both")
        server = actionlib.SimpleActionServer("count", CountAction, auto_start=False)
        cancelled = threading.Event()
        def take_on():
            print("goal", server.next_goal.get_goal().top)
            server.accept_new_goal()
        server.register_goal_callback(take_on)
        def give_way():
            print("preempt", server.is_preempt_requested())
            server.set_preempted(CountResult(1))
        server.register_preempt_callback(give_way)
        server.start()
        client = actionlib.SimpleActionClient("//count", CountAction)  # rospy tidies names
        print(client.get_state(), client.wait_for_server(rospy.Duration(60)))
        active = threading.Event()
        client.send_goal(CountGoal(7), active_cb=active.set)
        active.wait(60)
        client.cancel_all_goals()
        print(client.wait_for_result(rospy.Duration(60)), client.get_state(), server.is_active())
        lost = actionlib.SimpleActionClient("nothing", CountAction)
        print(lost.wait_for_server(rospy.Duration(0.05)))
        """,
        ROSZ_PACKAGE_PATH=path,
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["9 True", "goal 7", "preempt True", "True 2 False", "False"]


@pytest.mark.system
def test_handles_of_goals(network: Network) -> None:
    """The file beside the program was written with ROS 1's actionlib and roscore."""
    program = network.run("-m", "rosz.ros1", str(PROGRAMS / "goals.py"))
    assert program.exit_code() == 0, program.output
    lines = [line for line in program.lines if line.startswith("= ")]
    assert lines == (PROGRAMS / "goals.txt").read_text().splitlines()


@pytest.mark.ros1
def test_all_names_of_actionlib() -> None:
    snippet = """
        bound = {}
        exec("from actionlib import *", bound)
        result = sorted(set(bound) - {"__builtins__"})
    """
    states = {"CommStateMachine", "INVALID_TRANSITION", "NO_TRANSITION", "g_goal_id", "nop_cb"}
    theirs = real(snippet, "actionlib", "python3-actionlib")
    assert in_rosz(snippet) == [name for name in theirs if name not in states]


@pytest.mark.ros1
def test_messages_of_actions_are_those_of_ros1() -> None:
    store = TypeStore(package_index(Environment()))
    names = store.names("msg", "actionlib")
    ours = {name: store.message(name)._md5sum for name in names}
    theirs = real(
        f"""
        import actionlib.msg
        result = {{
            name: getattr(actionlib.msg, name.split("/")[1])._md5sum for name in {names}
        }}
        """,
        "actionlib",
        "python3-actionlib",
    )
    assert len(ours) == 21
    assert ours == theirs
