"""rospy's times, rates and timers; the outputs are those of real rospy 1.15."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest
from network import Network

from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.client.rospy import rostime

from .rospy_programs import Printed

Time: Any = rostime.Time
Duration: Any = rostime.Duration


@pytest.mark.parametrize(
    ("made", "shown"),
    [
        (Time(), "rospy.Time[0]"),
        (Time(1), "rospy.Time[1000000000]"),
        (Time(1.5), "rospy.Time[1500000000]"),
        (Time(1, 1500000000), "rospy.Time[2500000000]"),
        (Time(secs=1, nsecs=5), "rospy.Time[1000000005]"),
        (Time(1, -5), "rospy.Time[999999995]"),
        (Time.from_sec(1.5), "rospy.Time[1500000000]"),
        (Time.from_seconds(2), "rospy.Time[2000000000]"),
        (Duration(-1.5), "rospy.Duration[-1500000000]"),
        (Duration(0, -1), "rospy.Duration[-1]"),
        (Duration.from_sec(0.1), "rospy.Duration[100000000]"),
        (Time(5) + Duration(2), "rospy.Time[7000000000]"),
        (Time(5) - Duration(2), "rospy.Time[3000000000]"),
        (Duration(3) * 2, "rospy.Duration[6000000000]"),
        (0.5 * Duration(3), "rospy.Duration[1500000000]"),
        (Duration(3) / 2, "rospy.Duration[1500000000]"),
        (-Duration(3), "rospy.Duration[-3000000000]"),
        (abs(Duration(-3)), "rospy.Duration[3000000000]"),
        (Duration(7) % Duration(3), "rospy.Duration[1000000000]"),
        (sum([Duration(1), Duration(2)], Duration()), "rospy.Duration[3000000000]"),
        (max(Time(1), Time(3)), "rospy.Time[3000000000]"),
        (copy.deepcopy(Time(1, 2)), "rospy.Time[1000000002]"),
        (pickle.loads(pickle.dumps(Time(1, 2))), "rospy.Time[1000000002]"),
    ],
    ids=str,
)
def test_values(made: object, shown: str) -> None:
    assert repr(made) == shown


def test_differences_and_comparisons() -> None:
    assert type(Time(5) - Time(2)) is DurationMessage
    assert (Time(5) - Time(2)).to_sec() == 3.0
    assert Duration(7) // Duration(2) == 3
    assert Duration(3) / Duration(2) == 1.5
    assert Time(3) == TimeMessage(3, 0)
    assert Time(3) > TimeMessage(2, 9)
    assert isinstance(Time(3), TimeMessage)
    assert not isinstance(TimeMessage(), rostime.Time)
    assert not Time()
    assert {Time(1): 2}[TimeMessage(1, 0)] == 2
    assert Time(1, 5).to_nsec() == 1000000005
    assert (Time(1).secs, Time(1, 5).nsecs) == (1, 5)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [((-1,), TypeError), ((0, -1), TypeError), ((1.5, 3), ValueError), (("a",), ValueError)],
)
def test_invalid_times(arguments: tuple[Any, ...], error: type[Exception]) -> None:
    with pytest.raises(error):
        Time(*arguments)


def test_times_in_messages() -> None:
    header = Header(stamp=Time(3, 5), frame_id="map")
    assert Header.from_cdr(header.to_cdr()).stamp == Time(3, 5)
    assert type(header.stamp - Time(1)) is DurationMessage


def test_clock_functions(printed: Printed) -> None:
    assert printed("""
        import time, rospy
        show("wall", rospy.rostime.is_wallclock)
        rospy.rostime.set_rostime_initialized(True)
        rospy.init_node("times")
        print(rospy.rostime.is_rostime_initialized(), rospy.rostime.is_wallclock())
        before, seconds, now, after = time.time(), rospy.get_time(), rospy.Time.now(), time.time()
        print(before - 1 < seconds < after + 1)
        print(before - 1 < now.to_sec() < after + 1)
        print(type(rospy.get_rostime()) is rospy.Time, type(rospy.get_time()))
        began = time.monotonic()
        rospy.sleep(rospy.Duration(0.05))
        rospy.sleep(0.05)
        print(time.monotonic() - began >= 0.1)
        show("negative", lambda: rospy.sleep(-1))
        show("text", lambda: rospy.sleep("a"))
        show("zero", lambda: rospy.Rate(0))
        """) == [
        "wall -> True",
        "True True",
        "True",
        "True",
        "True <class 'float'>",
        "True",
        "negative -> None",
        "text -> TypeError | '<' not supported between instances of 'str' and 'int'",
        "zero -> ZeroDivisionError | float division by zero",
    ]


def test_rate(printed: Printed) -> None:
    assert printed("""
        import time, rospy
        rospy.init_node("rates")
        began = time.monotonic()
        rate = rospy.Rate(50)
        print(rate.sleep_dur, type(rate.last_time) is rospy.Time)
        for _ in range(10):
            rate.sleep()
        print(time.monotonic() - began >= 0.19)
        time.sleep(0.5)
        print(rate.remaining().to_sec() < -0.4)
        rate.sleep()
        print(rate.remaining().to_sec() <= 0.02)
        """) == ["20000000 True", "True", "True", "True"]


def test_timers(printed: Printed) -> None:
    lines = printed("""
        import threading, rospy
        rospy.init_node("timers")
        events, three = [], threading.Event()
        def take(event):
            events.append(event)
            if len(events) == 3:
                three.set()
        timer = rospy.Timer(rospy.Duration(0.02), take)
        print(isinstance(timer, threading.Thread), timer.daemon, timer.is_alive(), three.wait(60))
        timer.shutdown()
        timer.join(60)
        print(timer.is_alive())
        first, third = events[0], events[2]
        print(first.last_expected, first.last_real, first.last_duration)
        print(type(third.last_real) is rospy.Time, third.last_duration < 60)
        print((third.current_expected - third.last_expected).to_sec())
        print(third.current_real >= third.current_expected)
        once = []
        rospy.Timer(rospy.Duration(0.01), once.append, oneshot=True).join(60)
        print(len(once))
        def fail(event):
            raise ValueError("boom")
        failing = rospy.Timer(rospy.Duration(0.01), fail)
        failing.join(60)
        print(failing.is_alive())
        """)
    assert lines[:7] == [
        "True True True True",
        "False",
        "None None None",
        "True True",
        "0.02",
        "True",
        "1",
    ]
    assert lines[-2:] == ["ValueError: boom", "False"]


def test_tests_set_the_time(printed: Printed) -> None:
    assert printed("""
        import rospy, threading, time
        rospy.rostime.set_rostime_initialized(True)
        rospy.rostime._set_rostime(rospy.Time(5))
        print(rospy.Time.now(), rospy.rostime.is_wallclock())
        slept = threading.Event()
        def sleep():
            rospy.sleep(10)
            slept.set()
        threading.Thread(target=sleep, daemon=True).start()
        seconds = 5
        while not slept.wait(0.01):
            seconds += 1
            rospy.rostime._set_rostime(rospy.Time(seconds))
        print(seconds >= 15)
        rospy.rostime.switch_to_wallclock()
        print(abs(rospy.get_time() - time.time()) < 60, rospy.rostime.is_wallclock())
        try:
            rospy.rostime._set_rostime(5)
        except ValueError as error:
            print(error)
        """) == [
        "5000000000 False",
        "True",
        "True True",
        "must be Time instance: <class 'int'>",
    ]


def test_simulated_time(network: Network, printed: Printed) -> None:
    node = network.node("simulator")
    node.params.set("/use_sim_time", True)
    lines = printed("""
        import threading, rospy
        from itertools import count, repeat
        from rosgraph_msgs.msg import Clock
        from rosz.ros1.state import state
        rospy.init_node("simulated")
        ticks = rospy.Publisher("/clock", Clock, queue_size=1)
        print(rospy.rostime.is_wallclock(), rospy.get_time())
        times = [count(10.0, 0.25)]
        def tick():
            while not rospy.is_shutdown():
                ticks.publish(rospy.Time.from_sec(next(times[0])))
                pause.wait(0.01)
        pause = threading.Event()
        threading.Thread(target=tick, daemon=True).start()
        rospy.sleep(1)
        start = rospy.get_time()
        rospy.sleep(20)
        print(20 <= rospy.get_time() - start < 400)  # a sleep in real time would take 500
        rate = rospy.Rate(1)
        rate.sleep()
        rate.sleep()
        again = threading.Event()
        rospy.Timer(rospy.Duration(2), lambda event: again.set(), oneshot=True)
        print(again.wait(60))
        def back():
            while not state.node.clock._source.sleepers:
                pause.wait(0.01)
            times[0] = repeat(1.0)
        threading.Thread(target=back).start()
        show("back", lambda: rospy.sleep(1e6))
        print(rospy.get_time())
        """)
    assert lines == [
        "False 0.0",
        "True",
        "True",
        "back -> ROSTimeMovedBackwardsException | ROS time moved backwards",
        "1.0",
    ]
