"""Python programs that use roslibpy, with both of its transports."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.actions import ActionlibClient
from rosz.msgs.actionlib.action import Test as TestAction
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool

from .bridge import Bridge, Doubling, bridge_on

pytestmark = pytest.mark.system

PROGRAM = """
    import sys, threading
    import roslibpy
    roslibpy.set_default_transport(sys.argv[2])
    ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
    ros.run(timeout=50)

    heard = threading.Event()
    listener = roslibpy.Topic(ros, "/chatter", "std_msgs/String")
    def hear(message):
        print("heard", message["data"])
        heard.set()
    listener.subscribe(hear)
    talker = roslibpy.Topic(ros, "/pose", "geometry_msgs/PoseStamped")
    talker.advertise()
    talker.publish({"pose": {"position": {"x": 1}}, "header": {"frame_id": "map"}})
    heard.wait(50)
    listener.unsubscribe()

    flip = roslibpy.Service(ros, "/flip", "std_srvs/SetBool")
    print("flip", flip.call(roslibpy.ServiceRequest({"data": True}), timeout=50))
    try:
        flip.call(roslibpy.ServiceRequest({"data": False}), timeout=50)
    except Exception as error:
        print("refused", error)

    def serve(request, response):
        response["success"] = not request["data"]
        response["message"] = "from roslibpy"
        return True
    served = roslibpy.Service(ros, "/served", "std_srvs/SetBool")
    served.advertise(serve)

    rate = roslibpy.Param(ros, "/rate")
    rate.set({"hz": [1, 2.5]})
    print("rate", rate.get())
    rate.delete()
    print("topics", sorted(one for one in ros.get_topics() if one in ("/chatter", "/pose")))
    print("type", ros.get_topic_type("/pose"))
    print("time", ros.get_time()["secs"] > 0)
    print("ready")
    sys.stdin.readline()
    served.unadvertise()
    talker.unadvertise()
    ros.terminate()
    print("done")
"""


@pytest.fixture
def bridge(network: Network) -> Iterator[Bridge]:
    with bridge_on(network) as made:
        yield made


@pytest.mark.parametrize("transport", ["twisted", "asyncio"])
def test_a_program(bridge: Bridge, transport: str) -> None:
    node = bridge.network.node("other")
    poses: SimpleQueue[PoseStamped] = SimpleQueue()
    node.subscription("pose", PoseStamped, poses.put)
    node.publisher("chatter", String, latch=True).publish("from rosz")

    def flip(request: Any) -> Any:
        if not request.data:
            raise ValueError("never false")
        return True, "flipped"

    node.service("flip", SetBool, flip)
    bridge.wait_for_subscription("/pose")
    bridge.wait_for_service("/flip")
    program = bridge.network.program(PROGRAM, str(bridge.server.port), transport)
    program.wait_for("ready")
    pose = poses.get(timeout=TIMEOUT)
    assert (pose.pose.position.x, pose.header.frame_id) == (1.0, "map")
    assert pose.header.stamp.to_nsec() > 0
    assert "heard from rosz" in program.lines
    assert "flip {'success': True, 'message': 'flipped'}" in program.lines
    assert any(line.startswith("refused") and "never false" in line for line in program.lines)
    assert "rate {'hz': [1, 2.5]}" in program.lines
    assert "topics ['/chatter', '/pose']" in program.lines
    assert "type geometry_msgs/PoseStamped" in program.lines
    assert "time True" in program.lines
    client = node.client("served", SetBool)
    client.wait_for_service(TIMEOUT)
    response = client(data=False)
    assert (response.success, response.message) == (True, "from roslibpy")
    program.say("go")
    program.wait_for("done")
    assert program.exit_code(TIMEOUT) == 0


ACTION = """
    import sys, threading
    import roslibpy
    ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
    ros.run(timeout=50)
    client = roslibpy.ActionClient(ros, "/fib", "example_interfaces/Fibonacci")
    over = threading.Event()
    def end(result):
        print("result", result["status"].value, result["values"]["sequence"])
        over.set()
    goal = client.send_goal(roslibpy.Goal({"order": 3}), end,
                            lambda one: print("feedback", one["sequence"]),
                            lambda error: print("failed", error))
    over.wait(50)
    ros.terminate()
"""


def test_goals(bridge: Bridge) -> None:
    node = bridge.network.node("server")
    heard = threading.Event()

    def execute(goal: Any) -> None:
        goal.feedback(Fibonacci.Feedback([0, 1]))
        heard.wait(TIMEOUT)
        goal.succeed(Fibonacci.Result([0, 1, 1]))

    node.action_server("fib", Fibonacci, execute)
    bridge.wait_for_service("/fib/_action/send_goal")
    program = bridge.network.program(ACTION, str(bridge.server.port))
    program.wait_for("feedback [0, 1]")
    heard.set()
    assert program.exit_code(TIMEOUT) == 0, program.output
    assert "result 4 [0, 1, 1]" in program.lines


ACTIONLIB = """
    import sys, threading
    import roslibpy
    from roslibpy.ros1 import actionlib
    from roslibpy.ros1.actionlib import ActionClient, Goal, SimpleActionServer
    actionlib.DEFAULT_CONNECTION_TIMEOUT = 50
    roslibpy.set_default_transport(sys.argv[2])
    ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
    ros.run(timeout=50)
    def states(goal):
        reached = [threading.Event() for _ in range(10)]
        goal.on("status", lambda status: reached[status["status"]].set())
        return reached
    served = SimpleActionServer(ros, "/doubled", "actionlib/TestAction")
    def execute(goal):
        if goal["goal"] < 0:
            served.send_feedback({"feedback": 7})
            while not served.is_preempt_requested():
                pass
            served.set_preempted()
        else:
            served.set_succeeded({"result": 2 * goal["goal"]})
    served.start(execute)
    for name in "/native", "/classic", "/doubled":
        client = ActionClient(ros, name, "actionlib/TestAction")
        goal = Goal(client, {"goal": 13})
        reached = states(goal)
        goal.send()
        print(name, goal.wait(50)["result"], reached[3].wait(50))
        goal = Goal(client, {"goal": -1})
        reached = states(goal)
        heard = threading.Event()
        goal.on("feedback", lambda one: one["feedback"] == 7 and heard.set())
        goal.send()
        print(name, "feedback", heard.wait(50))
        goal.cancel()
        print(name, goal.wait(50)["result"], reached[2].wait(50))
        client.dispose()
    print("ready")
    sys.stdin.readline()
    ros.terminate()
"""


@pytest.mark.parametrize("transport", ["twisted", "asyncio"])
def test_actionlib(bridge: Bridge, transport: str) -> None:
    """A program is client and server of ROS 1's actions; rosz has either kind at the other end."""
    node = bridge.network.node("server")
    Doubling(node)
    bridge.wait_for_service("/native/_action/send_goal")
    program = bridge.network.program(ACTIONLIB, str(bridge.server.port), transport)
    program.wait_for("ready", 4 * TIMEOUT)
    assert [line for line in program.lines if line.startswith("/")] == [
        line
        for name, last in (("/native", 5), ("/classic", 5), ("/doubled", 0))
        for line in (f"{name} 26 True", f"{name} feedback True", f"{name} {last} True")
    ]
    client = ActionlibClient(node, "doubled", node.context.types.message("actionlib/TestAction"))
    assert client.wait_for_server(TIMEOUT)
    goal = client.send(TestAction.Goal(4))
    assert goal.wait(TIMEOUT)
    assert goal.result.result == 8
    program.say("end")
    assert program.exit_code(TIMEOUT) == 0
