"""message_filters compared with the real ones: the same messages in the same order."""

from __future__ import annotations

import random
import time

import pytest
from network import Network
from oracle import same

from rosz.msgs.builtin_interfaces.msg import Time

_SETUP = """
import rospy
import message_filters
from genpy import Time
from std_msgs.msg import Header, String
rospy.rostime.set_rostime_initialized(True)
class Stamped:
    def __init__(self, name, seconds):
        self.name, self.header = name, Header(stamp=Time.from_sec(seconds))
sources = [message_filters.SimpleFilter() for _ in range(3)]
heard = []
def callback(*found):
    heard.append([one.name if hasattr(one, "name") else one for one in found])
"""


@pytest.fixture(autouse=True)
def time_without_a_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosz.ros1.client.rospy.Time.now", lambda: Time.from_sec(time.time()))


def events(seed: int, spread: float) -> list[tuple[int, float]]:
    """Messages of three sources, out of step and sometimes missing or out of order."""
    chance = random.Random(seed)
    made = [
        (source, round(turn * 0.1 + chance.uniform(0, spread), 4))
        for turn in range(20)
        for source in range(3)
        if chance.random() > 0.1
    ]
    for _ in range(5):
        place = chance.randrange(len(made) - 1)
        made[place], made[place + 1] = made[place + 1], made[place]
    return made


_PLAY = (
    _SETUP
    + """
def played(made, begin):
    del heard[:]
    sources[:] = [message_filters.SimpleFilter() for _ in range(3)]
    begin()
    for number, (source, stamp) in enumerate(made):
        sources[source].signalMessage(Stamped(f"{source}:{number}", 1 + stamp))
    return list(heard)
"""
)


@pytest.mark.ros1
def test_approximate_time_synchronizer() -> None:
    same(
        _PLAY
        + f"""
def begin(slop):
    message_filters.ApproximateTimeSynchronizer(sources, 5, slop).registerCallback(callback)
result = [[played(made, lambda: begin(slop)) for slop in (0.01, 0.05, 0.2)]
    for made in {[events(seed, 0.04) for seed in range(5)]}]
""",
        "message_filters, rospy",
        "python3-message-filters",
    )


@pytest.mark.ros1
def test_time_synchronizer() -> None:
    same(
        _PLAY
        + f"""
def begin():
    message_filters.TimeSynchronizer(sources, 5).registerCallback(callback, "more")
result = [played(made, begin) for made in {[events(seed, 0.0) for seed in range(3)]}]
""",
        "message_filters, rospy",
        "python3-message-filters",
    )


@pytest.mark.ros1
def test_messages_without_stamps() -> None:
    same(
        _SETUP
        + """
message_filters.ApproximateTimeSynchronizer(
    sources[:2], 5, 10, allow_headerless=True).registerCallback(callback)
class Plain:
    name = "plain"
for source in sources[:2]:
    source.signalMessage(Plain())
result = heard
""",
        "message_filters, rospy",
        "python3-message-filters",
    )


@pytest.mark.ros1
def test_cache() -> None:
    same(
        _SETUP
        + """
cache = message_filters.Cache(sources[0], 3)
cache.registerCallback(callback)
result = [str(cache.getLast()), str(cache.getLatestTime()), str(cache.getOldestTime())]
for number, seconds in enumerate([5, 1, 2, 4, 3]):
    sources[0].signalMessage(Stamped(str(number), seconds))
name = lambda one: one.name if one else None
result += heard + [
    [one.name for one in cache.getInterval(Time(2), Time(4))],
    name(cache.getElemAfterTime(Time(3))), name(cache.getElemAfterTime(Time(9))),
    name(cache.getElemBeforeTime(Time(3))), name(cache.getElemBeforeTime(Time(1))),
    cache.getLatestTime().to_sec(), cache.getOldestTime().to_sec(), cache.getLast().name,
]
""",
        "message_filters, rospy",
        "python3-message-filters",
    )


@pytest.mark.ros1
def test_a_jump_of_time_clears_the_queues(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    same(
        _SETUP
        + """
sync = message_filters.ApproximateTimeSynchronizer(sources[:2], 5, 0.1)
sync.registerCallback(callback)
kept = []
for number, now in enumerate((10, 11, 10.5, 12)):
    rospy.rostime._set_rostime(Time.from_sec(now))
    for source in sources[:2]:
        source.signalMessage(Stamped(str(number), number))
        kept.append([len(queue) for queue in sync.queues])
rospy.rostime.switch_to_wallclock()
result = [heard, kept]
""",
        "message_filters, rospy",
        "python3-message-filters",
    )


def test_subscribers(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import message_filters
        import rospy
        from geometry_msgs.msg import PointStamped

        rospy.init_node("pair")
        subscribers = [message_filters.Subscriber(name, PointStamped) for name in ("a", "b")]
        print(subscribers[0].getTopic(), subscribers[0].name)
        def both(a, b):
            print("both", a.point.x, b.point.x)
            rospy.signal_shutdown("")
        message_filters.TimeSynchronizer(subscribers, 10).registerCallback(both)
        publishers = [rospy.Publisher(name, PointStamped, queue_size=5) for name in ("a", "b")]
        rate = rospy.Rate(50)
        while not rospy.is_shutdown():
            stamp = rospy.Time.now()
            for x, publisher in enumerate(publishers):
                message = PointStamped()
                message.header.stamp, message.point.x = stamp, x
                publisher.publish(message)
            try:
                rate.sleep()
            except rospy.ROSInterruptException:
                pass
        """
    )
    program.wait_for("both 0.0 1.0")
    assert program.exit_code() == 0
    assert program.lines[0] == "a /a"


def test_nodes_of_rclpy(network: Network) -> None:
    """The arguments, times and clocks of ROS 2."""
    program = network.program(
        """
        import rosz.ros1
        import message_filters, rclpy
        from rclpy.duration import Duration
        from rclpy.time import Time
        from sensor_msgs.msg import FluidPressure, Temperature
        from std_msgs.msg import Header, String

        rclpy.init()
        node = rclpy.create_node("n")
        sources = [
            message_filters.Subscriber(node, Temperature, "temperature", qos_profile=5),
            message_filters.Subscriber(node, FluidPressure, "pressure"),
        ]
        near = message_filters.ApproximateTimeSynchronizer(sources, 10, 0.05)
        equal = message_filters.TimeSynchronizer(sources, 10)
        cache = message_filters.Cache(sources[0], 100)
        words = message_filters.SimpleFilter()
        words.node = node
        late = message_filters.Cache(words, 1, allow_headerless=True)
        heard = set()
        def near_each_other(temperature, pressure):
            shift = Time.from_msg(pressure.header.stamp) - Time.from_msg(temperature.header.stamp)
            heard.add(f"near {abs(shift.nanoseconds)}")
        near.registerCallback(near_each_other)
        equal.registerCallback(lambda temperature, pressure: heard.add("equal"))
        first = node.create_publisher(Temperature, "temperature", 10)
        second = node.create_publisher(FluidPressure, "pressure", 10)
        def publish():
            now = node.get_clock().now()
            first.publish(Temperature(header=Header(stamp=now.to_msg())))
            second.publish(FluidPressure(header=Header(stamp=now.to_msg())))
            if {"near 0", "equal"} <= heard and not node.done:
                node.done = True
                words.signalMessage(String())
                print(cache.getInterval(now - Duration(seconds=60), now) != [])
                print(now - Duration(seconds=60) < cache.getLatestTime(), late.getLast())
                rclpy.shutdown()
        node.done = False
        node.create_timer(0.1, publish)
        rclpy.spin(node)
        print(sources[1].getTopic(), sorted(heard & {"near 0", "equal"}))
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines[-3:] == ["True", "True data: ''", "pressure ['equal', 'near 0']"]
