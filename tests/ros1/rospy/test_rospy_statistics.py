"""Statistics of topics; the figures are those of real rospy 1.15 for the same arrivals."""

from __future__ import annotations

from typing import Any, cast

import pytest

from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.msgs.geometry_msgs.msg import PointStamped
from rosz.msgs.rosgraph_msgs.msg import TopicStatistics
from rosz.msgs.std_msgs.msg import Header, String
from rosz.node import MessageInfo
from rosz.params.replica import Params
from rosz.ros1.client.rospy.statistics import Statistics

from .rospy_programs import Printed

SECOND = 1_000_000_000


class _Given:
    """Parameters that a test gives."""

    def __init__(self, values: dict[str, float]) -> None:
        self._values = values

    def get(self, name: str, default: float, **_options: object) -> float:
        return self._values.get(name.removeprefix("/statistics_window_"), default)


def measured(values: dict[str, float], arrivals: list[Any]) -> list[TopicStatistics]:
    """Return the statistics of messages that arrive at times in seconds, as (time, message)."""
    found: list[TopicStatistics] = []
    statistics = Statistics("/x", "/here", cast("Params", _Given(values)), found.append)
    for number, (time, message) in enumerate(arrivals):
        info = MessageInfo(0, 0, number, b"", int(number == 3), "", size=10)
        statistics.record(message, info, "/there", round(time * SECOND))
    return found


def test_a_window_is_summed_up() -> None:
    times = [100.0, 100.2, 100.4, 100.8, 101.1, 102.1]
    first, second = measured({}, [(time, String()) for time in times])
    assert (first.delivered_msgs, first.traffic, first.period_max) == (1, 10, Duration())
    assert (second.topic, second.node_pub, second.node_sub) == ("/x", "/there", "/here")
    assert (second.window_start, second.window_stop) == (Time(100), Time(102, 100_000_000))
    assert (second.delivered_msgs, second.dropped_msgs, second.traffic) == (5, 1, 50)
    assert second.period_mean.to_sec() == pytest.approx(0.475)
    assert second.period_stddev.to_sec() == pytest.approx(0.311247488)
    assert second.period_max.to_sec() == pytest.approx(1.0)
    assert second.stamp_age_max == Duration()


def test_ages_of_messages_with_a_header() -> None:
    header = Header(0, Time(99), "map")
    found = measured({}, [(time, PointStamped(header)) for time in (100, 100.5, 102.5)])
    last = found[1]
    assert found[0].stamp_age_mean == found[0].stamp_age_max == Duration(1)
    assert last.stamp_age_mean.to_sec() == 2.5
    assert (last.stamp_age_stddev, last.stamp_age_max.to_sec()) == (Duration(1), 3.5)


def test_windows_get_longer_and_shorter() -> None:
    slow = [(time, String()) for time in range(1, 30)]
    ends = [one.window_stop.to_sec() for one in measured({"min_elements": 5}, slow)]
    assert ends == [2, 5, 10, 15, 20, 25]
    fast = [(1 + time / 10, String()) for time in range(60)]
    found = measured({"max_elements": 3, "min_size": 0.1}, fast)
    assert [one.window_stop.to_sec() for one in found] == [1.1, 3.2, 4.3, 4.9, 5.5, 6.1, 6.7]


def test_a_node_publishes_what_it_measures(printed: Printed) -> None:
    assert printed("""
        import threading
        import rospy
        from rosgraph_msgs.msg import TopicStatistics
        from std_msgs.msg import String
        rospy.init_node("measured")
        rospy.set_param("/enable_statistics", True)
        came = threading.Event()
        found = []
        def take(message):
            found.append(message)
            came.set()
        rospy.Subscriber("/statistics", TopicStatistics, take)
        words = rospy.Publisher("words", String, queue_size=1)
        heard = rospy.Subscriber("words", String)
        while not came.wait(0.05):
            words.publish("hello")
        one = found[0]
        print(one.topic, one.node_pub, one.node_sub, one.delivered_msgs, one.traffic)
        heard.unregister()
        """) == ["/words /measured /measured 1 14"]
