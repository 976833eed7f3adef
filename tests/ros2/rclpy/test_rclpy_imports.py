"""What public packages for ROS 2 import, in programs of their own."""

from __future__ import annotations

from network import Network

from rosz.msgs.std_msgs.msg import Int32
from rosz.ros2.rclpy.program import NodeStrategy, get_topic_names_and_types

from .conftest import World


def test_names_that_editors_import_from_other_modules(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        from rclpy.clock import Clock, Duration
        from rclpy.executors import Future
        from rclpy.node import (
            Node, ParameterDescriptor, ParameterNotDeclaredException, ParameterType, get_logger
        )
        from rclpy.service import Service, ServiceIntrospectionState
        from rclpy.topic_endpoint_info import QoSHistoryPolicy, TopicEndpointTypeEnum

        assert Duration is rclpy.duration.Duration and Future is rclpy.task.Future
        assert rclpy.Context is rclpy.context.Context
        assert ParameterType.PARAMETER_BOOL == 1 and TopicEndpointTypeEnum.PUBLISHER == 1
        try:
            from rclpy.node import Nothing
        except ImportError as error:
            print("Nothing" in str(error))
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["True"]


def test_modules_of_rclpy(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        from rclpy._rclpy_pybind11 import RCLError
        from rclpy.clock_type import ClockType
        from rclpy.constants import S_TO_NS
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.handle import InvalidHandle
        from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
        from rclpy.lifecycle.node import LifecycleNode, LifecycleState, TransitionCallbackReturn

        assert _rclpy.RCLError is RCLError and S_TO_NS == 10**9
        print(rclpy.expand_topic_name.expand_topic_name("a", "n", "/ns"))
        print(rclpy.expand_topic_name.expand_topic_name("~/a", "n", "/"))
        try:
            rclpy.expand_topic_name.expand_topic_name("not a name", "n", "/")
        except rclpy.exceptions.InvalidTopicNameException:
            print("not legal")
        rclpy.init()
        publisher = LifecycleNode("n").create_publisher(rclpy.node.ParameterDescriptor, "t", 1)
        rclpy.shutdown()
        try:
            publisher.publish(rclpy.node.ParameterDescriptor())
        except RCLError:
            print("shut down")
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["/ns/a", "/n/a", "not legal", "shut down"]


def test_modules_of_types_as_in_ros2(network: Network) -> None:
    package = network.folder / "src" / "bolts"
    for file, text in {
        "package.xml": "<package><name>bolts</name></package>",
        "msg/Bolt3D.msg": "int32 size",
        "bolts/__init__.py": "from .tools import WHO",
        "bolts/tools.py": "WHO = 'without a setup.py'",
        "bolts/msg.py": "",
    }.items():
        (package / file).parent.mkdir(parents=True, exist_ok=True)
        (package / file).write_text(text)
    program = network.program(
        """
        import rosz.ros1
        import bolts
        from bolts.msg._bolt3_d import Bolt3D
        from example_interfaces.action._fibonacci import Fibonacci, Fibonacci_FeedbackMessage
        from geometry_msgs.msg._pose_with_covariance import PoseWithCovariance
        from std_srvs.srv._set_bool import SetBool, SetBool_Request

        assert SetBool_Request is SetBool.Request
        assert Fibonacci_FeedbackMessage is Fibonacci.Impl.FeedbackMessage
        assert Fibonacci.Impl.SendGoalService is Fibonacci.SendGoal
        assert Fibonacci.Impl.GetResultService is Fibonacci.GetResult
        print(bolts.WHO, Bolt3D(size=2).size)
        try:
            import std_msgs.msg._nothing
        except ModuleNotFoundError as error:
            print(error.name)
        """,
        ROSZ_PACKAGE_PATH=str(network.folder / "src"),
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["without a setup.py 2", "std_msgs.msg._nothing"]


def test_an_updater_of_diagnostics(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from diagnostic_updater import FrequencyStatus, FrequencyStatusParam, Updater

        rclpy.init()
        node = rclpy.create_node("robot", namespace="a")
        updater = Updater(node, period=0.02)
        updater.setHardwareID("arm")
        updater.add(FrequencyStatus(FrequencyStatusParam({"min": 0.0, "max": 1.0})))
        updater.update()
        seen = []
        node.create_subscription(DiagnosticArray, "/diagnostics", seen.append, 10)
        while not any(status.hardware_id for array in seen for status in array.status):
            rclpy.spin_once(node)
        print(seen[-1].status[0].name, seen[-1].status[0].message)
        rclpy.shutdown()
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["a/robot: FrequencyStatus No events recorded."]


def test_topics_by_the_functions_of_the_commands(world: World) -> None:
    world.node.create_publisher(Int32, "numbers", 1)
    world.node.create_publisher(Int32, "/_hidden", 1)
    with NodeStrategy(None) as node:
        assert node.get_name().startswith("_ros2cli_")
        numbers, hidden = ((name, ["std_msgs/msg/Int32"]) for name in ("/numbers", "/_hidden"))
        world.spin_until(lambda: numbers in get_topic_names_and_types(node=node), "the topic")
        assert hidden not in get_topic_names_and_types(node=node)
        assert hidden in get_topic_names_and_types(node=node, include_hidden_topics=True)
