"""rclpy.action: servers and clients, as ROS 2's tutorials write them."""

from __future__ import annotations

from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.errors import UsageError
from rosz.msgs.action_msgs.msg import GoalStatus
from rosz.msgs.example_interfaces.action import Fibonacci

SERVER = """
    import rclpy
    from example_interfaces.action import Fibonacci
    from rclpy.action import ActionServer, CancelResponse, GoalResponse
    from rclpy.callback_groups import ReentrantCallbackGroup
    from rclpy.executors import MultiThreadedExecutor
    from rclpy.node import Node

    class Server(Node):
        def __init__(self):
            super().__init__("server")
            self.server = ActionServer(
                self, Fibonacci, "fib", execute_callback=self.execute,
                callback_group=ReentrantCallbackGroup(), goal_callback=self.decide,
                cancel_callback=lambda handle: CancelResponse.ACCEPT)

        def decide(self, request):
            return GoalResponse.REJECT if request.order == 99 else GoalResponse.ACCEPT

        async def execute(self, handle):
            feedback = Fibonacci.Feedback()
            feedback.sequence = [0, 1]
            handle.publish_feedback(feedback)
            if handle.request.order == 13:
                raise ValueError("unlucky")
            while handle.request.order < 0:
                if handle.is_cancel_requested:
                    handle.canceled()
                    return Fibonacci.Result(sequence=[-1])
            if handle.request.order:
                handle.succeed()
            result = Fibonacci.Result()
            result.sequence = [0, 1, 1]
            return result

    rclpy.init()
    node = Server()
    print("ready")
    rclpy.spin(node, MultiThreadedExecutor())
"""

CLIENT = """
    import sys
    import rclpy
    from example_interfaces.action import Fibonacci
    from rclpy.action import ActionClient
    from rclpy.node import Node

    class Client(Node):
        def __init__(self):
            super().__init__("client")
            self.client = ActionClient(self, Fibonacci, "fib")
            self.left = 1 + ("cancel" in sys.argv)

        def send_goal(self, order):
            goal = Fibonacci.Goal()
            goal.order = order
            self.client.wait_for_server()
            future = self.client.send_goal_async(goal, feedback_callback=self.feedback)
            future.add_done_callback(self.answered)

        def answered(self, future):
            handle = future.result()
            print("accepted", handle.accepted)
            if not handle.accepted:
                rclpy.shutdown()
                return
            handle.get_result_async().add_done_callback(self.ended)
            if "cancel" in sys.argv:
                handle.cancel_goal_async().add_done_callback(self.canceling)

        def canceling(self, future):
            print("canceling", len(future.result().goals_canceling))
            self.end()

        def end(self):
            self.left -= 1
            if not self.left:
                rclpy.shutdown()

        def ended(self, future):
            response = future.result()
            print("result", response.status, list(response.result.sequence))
            self.end()

        def feedback(self, message):
            print("feedback", list(message.feedback.sequence))

    rclpy.init()
    client = Client()
    client.send_goal(int(sys.argv[1]))
    rclpy.spin(client)
"""
RUN = "import rosz.ros1\n"


@pytest.fixture
def server(network: Network) -> Any:
    program = network.program(indented(RUN) + SERVER)
    program.wait_for("ready")
    return program


def indented(text: str) -> str:
    return "".join(f"    {line}\n" for line in text.splitlines())


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("5",), ["accepted True", f"result {GoalStatus.STATUS_SUCCEEDED} [0, 1, 1]"]),
        (("0",), ["accepted True", f"result {GoalStatus.STATUS_ABORTED} [0, 1, 1]"]),
        (("13",), ["accepted True", f"result {GoalStatus.STATUS_ABORTED} []"]),
        (("99",), ["accepted False"]),
        (
            ("-1", "cancel"),
            ["accepted True", "canceling 1", f"result {GoalStatus.STATUS_CANCELED} [-1]"],
        ),
    ],
)
@pytest.mark.usefixtures("server")
def test_programs(network: Network, words: tuple[str, ...], expected: list[str]) -> None:
    client = network.program(indented(RUN) + CLIENT, *words)
    assert client.exit_code() == 0, client.output
    # The result may overtake the answer to the cancellation.
    assert sorted(line for line in client.lines if not line.startswith("feedback")) == expected


def test_a_server_of_rclpy_and_a_client_of_rosz(network: Network, server: Any) -> None:
    client = network.node("user").action_client("fib", Fibonacci)
    client.wait_for_server(TIMEOUT)
    assert list(client.send(Fibonacci.Goal(5)).result(TIMEOUT).sequence) == [0, 1, 1]
    del server


def test_a_client_of_rclpy_and_a_server_of_rosz(network: Network) -> None:
    def execute(goal: Any) -> None:
        goal.feedback(Fibonacci.Feedback([3]))
        goal.succeed(Fibonacci.Result([4]))

    network.node("server").action_server("fib", Fibonacci, execute)
    client = network.program(indented(RUN) + CLIENT, "1")
    assert client.exit_code() == 0, client.output
    assert f"result {GoalStatus.STATUS_SUCCEEDED} [4]" in client.lines


def test_deferred_execution(network: Network) -> None:
    """Execute accepted goals one by one, as ROS 2's examples of a queue do."""
    program = network.program(
        indented(RUN)
        + """
    import rclpy
    from collections import deque
    from example_interfaces.action import Fibonacci
    from rclpy.action import ActionServer
    from rclpy.node import Node

    waiting = deque()

    def execute(handle):
        handle.succeed()
        return Fibonacci.Result(sequence=[handle.request.order])

    def accepted(handle):
        waiting.append(handle)
        if len(waiting) == 2:
            while waiting:
                waiting.pop().execute()

    rclpy.init()
    node = Node("server")
    server = ActionServer(node, Fibonacci, "fib", execute, handle_accepted_callback=accepted)
    print("ready")
    rclpy.spin(node)
    """
    )
    program.wait_for("ready")
    client = network.node("user").action_client("fib", Fibonacci)
    client.wait_for_server(TIMEOUT)
    first = client.send(Fibonacci.Goal(1))
    second = client.send(Fibonacci.Goal(2))
    assert list(second.result(TIMEOUT).sequence) == [2]
    assert list(first.result(TIMEOUT).sequence) == [1]


def test_goals_of_other_types_are_refused() -> None:
    from rosz.ros2.rclpy.action import ActionClient

    client: Any = object.__new__(ActionClient)
    client._action_type = Fibonacci
    with pytest.raises(UsageError, match="expected Fibonacci_Goal"):
        client.send_goal_async(Fibonacci.Feedback())
