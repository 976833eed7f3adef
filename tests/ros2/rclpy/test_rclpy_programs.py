"""Programs with rclpy, as in tutorials, in processes of their own."""

from __future__ import annotations

import re
import signal
from itertools import count

from network import Network, eventually

from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.qos import CLOCK

TALKER = """
    import rosz.ros1
    import rclpy
    from rclpy.node import Node
    from std_msgs.msg import String

    class MinimalPublisher(Node):
        def __init__(self):
            super().__init__('minimal_publisher')
            self.publisher_ = self.create_publisher(String, 'topic', 10)
            timer_period = 0.02  # seconds
            self.timer = self.create_timer(timer_period, self.timer_callback)
            self.i = 0

        def timer_callback(self):
            msg = String()
            msg.data = 'Hello World: %d' % self.i
            self.publisher_.publish(msg)
            self.get_logger().info('Publishing: "%s"' % msg.data)
            self.i += 1

    def main(args=None):
        rclpy.init(args=args)
        minimal_publisher = MinimalPublisher()
        rclpy.spin(minimal_publisher)
        minimal_publisher.destroy_node()
        rclpy.shutdown()

    main()
"""

LISTENER = """
    import rosz.ros1
    import rclpy
    from rclpy.node import Node
    from std_msgs.msg import String

    class MinimalSubscriber(Node):
        def __init__(self):
            super().__init__('minimal_subscriber')
            self.subscription = self.create_subscription(
                String, 'topic', self.listener_callback, 10)
            self.subscription  # prevent unused variable warning

        def listener_callback(self, msg):
            self.get_logger().info('I heard: "%s"' % msg.data)

    rclpy.init()
    try:
        rclpy.spin(MinimalSubscriber())
    except KeyboardInterrupt:
        print("interrupted", rclpy.ok())
    rclpy.shutdown()
    print("ok", rclpy.ok())
"""


def test_talker_and_listener(network: Network) -> None:
    talker = network.program(TALKER)
    listener = network.program(LISTENER)
    line = listener.wait_for("I heard")
    assert re.fullmatch(
        r'\[INFO\] \[\d{10}\.\d{9}\] \[minimal_subscriber\]: I heard: "Hello World: \d+"', line
    )
    talker.wait_for("[minimal_publisher]: Publishing")
    listener.send(signal.SIGINT)
    assert listener.exit_code() == 0
    assert listener.lines[-2:] == ["interrupted True", "ok False"]
    talker.send(signal.SIGTERM)
    talker.wait_for("ExternalShutdownException")
    assert talker.exit_code() == 1


def test_log_options(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        rclpy.init()
        log = rclpy.create_node("talk", namespace="/ns").get_logger()
        for number in range(3):
            log.info(f"once {number}", once=True)
            log.warn(f"skipped {number}", skip_first=True)
            log.error(f"throttled {number}", throttle_duration_sec=60)
            log.debug("never")
        log.get_child("part").fatal("from a part")
        log.set_level(rclpy.logging.LoggingSeverity.DEBUG)
        log.debug("now")
        try:
            log.info("x", often=True)
        except TypeError as error:
            print(error)
        rclpy.logging.get_logger("plain").info("no node")
        """,
        RCUTILS_CONSOLE_OUTPUT_FORMAT="{severity} {name} {message} {other}",
    )
    assert program.exit_code() == 0
    assert program.lines == [
        "INFO ns.talk once 0 {other}",
        "ERROR ns.talk throttled 0 {other}",
        "WARN ns.talk skipped 1 {other}",
        "WARN ns.talk skipped 2 {other}",
        "FATAL ns.talk.part from a part {other}",
        "DEBUG ns.talk now {other}",
        "a logger takes no 'often'",
        "INFO plain no node {other}",
    ]


def test_arguments_of_ros1_and_ros2(network: Network) -> None:
    script = """
        import sys
        import rosz.ros1
        import rclpy
        from rclpy.utilities import remove_ros_args
        with rclpy.init(args=sys.argv):
            node = rclpy.create_node("n")
            node.declare_parameter("speed", 0.0)
            print(node.get_fully_qualified_name(), node.resolve_topic_name("a"),
                  node.get_parameter("speed").value, remove_ros_args(sys.argv)[1:])
        print(rclpy.ok())
    """
    ros2 = network.program(
        script, "x", "--ros-args", "-r", "a:=b", "-p", "speed:=1", "-r", "__node:=m"
    )
    assert ros2.exit_code() == 0
    assert ros2.lines == ["/m /b 1.0 ['x']", "False"]
    ros1 = network.program(script, "a:=b", "_speed:=2.5", "__name:=m", "__ns:=/k")
    assert ros1.exit_code() == 0
    assert ros1.lines[0].startswith("/k/m /k/b 2.5")


def test_init_again_after_shutdown(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        from std_msgs.msg import String
        for _ in range(2):
            rclpy.init()
            node = rclpy.create_node("n")
            heard = rclpy.Future()
            node.create_subscription(String, "t", lambda m: heard.set_result(m.data), 1)
            publisher = node.create_publisher(String, "t", 1)
            node.create_timer(0.01, lambda: publisher.publish(String(data="x")))
            rclpy.spin_until_future_complete(node, heard)
            print(heard.result())
            rclpy.shutdown()
        """
    )
    assert program.exit_code() == 0
    assert program.lines == ["x", "x"]


def test_simulated_time_by_parameter(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        rclpy.init()
        node = rclpy.create_node("n")
        def tick():
            print("tick", node.get_clock().now().seconds_nanoseconds()[0], flush=True)
        node.create_timer(10.0, tick)
        print("ready", node.get_clock().ros_time_is_active, flush=True)
        rclpy.spin(node)
        """,
        "--ros-args",
        "-p",
        "use_sim_time:=true",
    )
    assert program.wait_for("ready") == "ready True"
    clock = network.node("simulator").publisher("/clock", Clock, qos=CLOCK)
    clock.wait_for_subscribers()
    message = Clock()
    seconds = count(1)

    def ticked() -> bool:
        message.clock.sec = next(seconds)
        clock.publish(message)
        return "tick" in program.output

    eventually(ticked, "a tick")


def test_missing_modules_are_named(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        try:
            import rclpy.waitable
        except ModuleNotFoundError as error:
            print(error)
        try:
            rclpy.create_waitable
        except AttributeError as error:
            print(error)
        """
    )
    assert program.exit_code() == 0
    assert "rclpy.waitable" in program.lines[0]
    assert "create_waitable" in program.lines[1]
