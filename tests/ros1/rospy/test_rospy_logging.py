"""rospy's log functions; the lines are those of real rospy 1.15."""

from __future__ import annotations

import re

import pytest
from network import Network, eventually

from rosz.msgs.rcl_interfaces.msg import Log

from .rospy_programs import Printed, run, start

_STAMP = re.compile(r"\[\d{10}\.\d{6}\]")


def stamped(lines: list[str]) -> list[str]:
    return [_STAMP.sub("[T]", line) for line in lines]


def test_levels_and_formats(printed: Printed) -> None:
    assert stamped(
        printed("""
            import rospy
            rospy.init_node("logs")
            rospy.logdebug("hidden")
            rospy.loginfo("%s and %d", "text", 5)
            rospy.loginfo("100 %")
            rospy.loginfo({"a": 1})
            rospy.loginfo("child", logger_name="part")
            rospy.logout("out")
            rospy.logwarn("warn %d%%", 3)
            rospy.logerr("two\\nlines")
            rospy.logfatal("fatal")
            rospy.core.logerr("core")
            print(rospy.DEBUG, rospy.INFO, rospy.WARN, rospy.ERROR, rospy.FATAL)
            """)
    ) == [
        "[INFO] [T]: text and 5",
        "[INFO] [T]: 100 %",
        "[INFO] [T]: {'a': 1}",
        "[INFO] [T]: child",
        "[INFO] [T]: out",
        "[WARN] [T]: warn 3%",
        "[ERROR] [T]: two",
        "lines",
        "[FATAL] [T]: fatal",
        "[ERROR] [T]: core",
        "1 2 4 8 16",
    ]


def test_once_and_throttled_messages(printed: Printed) -> None:
    assert stamped(
        printed("""
            import rospy
            rospy.init_node("logs")
            for i in range(3):
                rospy.loginfo_once("once")
                rospy.loginfo_throttle(60, "throttled %d", i)
                rospy.logwarn_throttle(0, "each time")
                rospy.loginfo_throttle_identical(60, "same")
                rospy.logerr_throttle_identical(60, "text %d", i // 2)
                rospy.logdebug_once("hidden")
            """)
    ) == [
        "[INFO] [T]: once",
        "[INFO] [T]: throttled 0",
        "[WARN] [T]: each time",
        "[INFO] [T]: same",
        "[ERROR] [T]: text 0",
        "[WARN] [T]: each time",
        "[WARN] [T]: each time",
        "[ERROR] [T]: text 1",
    ]


def test_streams(printed: Printed) -> None:
    assert printed("""
        import io, sys, rospy
        rospy.init_node("logs", log_level=rospy.DEBUG)
        sys.stdout, sys.stderr = out, error = io.StringIO(), io.StringIO()
        for log in (rospy.logdebug, rospy.loginfo, rospy.logwarn, rospy.logerr, rospy.logfatal):
            log("x")
        sys.stdout = sys.__stdout__
        print(out.getvalue().count("DEBUG"), out.getvalue().count("\\n"))
        print(error.getvalue().count("\\n"))
        """) == ["1 2", "3"]


@pytest.mark.parametrize(
    ("form", "line"),
    [
        ("${node} ${logger} ${severity} ${message}", "/logs rosout INFO text"),
        ("${function}:${message}", "speak:text"),
    ],
)
def test_console_format(network: Network, form: str, line: str) -> None:
    assert run(
        network,
        """
        import rospy
        rospy.init_node("logs")
        def speak():
            rospy.loginfo("text")
        speak()
        """,
        ROSCONSOLE_FORMAT=form,
    ) == [line]


def test_levels_set_by_service_and_by_python_logging(printed: Printed) -> None:
    assert stamped(
        printed("""
            import logging
            import rospy
            from roscpp.srv import GetLoggers, SetLoggerLevel
            rospy.init_node("logs")
            rospy.wait_for_service("~set_logger_level", 60)
            rospy.wait_for_service("~get_loggers", 60)
            set_level = rospy.ServiceProxy("~set_logger_level", SetLoggerLevel)
            set_level("rosout", "debug")
            rospy.logdebug("shown")
            print(rospy.ServiceProxy("~get_loggers", GetLoggers)().loggers)
            set_level("rosout", "error")
            rospy.logwarn("hidden")
            set_level("rosout", "nonsense")
            rospy.logerr("still")
            logging.getLogger("rosout").error("python's")
            logging.getLogger("rosout.part").error("and below")
            from rospy.impl.rosout import _rospy_to_logging_levels
            logging.getLogger("rosout").setLevel(_rospy_to_logging_levels[rospy.DEBUG])
            rospy.logdebug("shown again")
            """)
    ) == [
        "[DEBUG] [T]: shown",
        "[Logger(name='rosout', level='DEBUG')]",
        "[ERROR] [T]: still",
        "[ERROR] [T]: python's",
        "[ERROR] [T]: and below",
        "[DEBUG] [T]: shown again",
    ]


def test_rosout(network: Network) -> None:
    node = network.node("reader")
    lines: list[Log] = []
    node.subscription("/rosout", Log, lines.append)
    for name, muted in (("mute", True), ("loud", False)):
        start(
            network,
            f"""
            import rospy
            rospy.init_node("{name}", disable_rosout={muted})
            rospy.logwarn("from {name}")
            rospy.spin()
            """,
        ).wait_for(f"from {name}")
    eventually(lambda: "from loud" in [line.msg for line in lines], "the line on /rosout")
    assert "from mute" not in [line.msg for line in lines]


def test_log_messages_name_the_topics_of_their_node(printed: Printed) -> None:
    assert (
        printed("""
        import threading
        import rospy
        from rosgraph_msgs.msg import Log
        from std_msgs.msg import String
        rospy.init_node("worker")
        complete = threading.Event()
        def take(message):
            if message.topics == ["/rosout", "/words"]:
                complete.set()
        rospy.Subscriber("/rosout", Log, take)
        words = rospy.Publisher("words", String, queue_size=1)
        while not complete.wait(0.05):  # the tokens of the node come back to it
            rospy.loginfo("working")
        print("complete")
        """)[-1]
        == "complete"
    )


def test_handlers_of_the_program(printed: Printed) -> None:
    lines = printed("""
        import logging
        import sys
        import rospy
        rospy.init_node("logged")
        rosout = logging.getLogger("rosout")
        own = logging.StreamHandler(sys.stdout)
        own.setFormatter(logging.Formatter("own %(name)s %(levelname)s %(message)s"))
        own.setLevel(logging.WARNING)
        rosout.addHandler(own)
        rospy.logwarn("hot %s", 5)
        rospy.loginfo("below its level")
        rospy.logwarn("part", logger_name="arm")
        logging.getLogger("rosout.leg").error("by Python")
        for _ in range(2):
            rospy.logwarn_once("once")
        rosout.removeHandler(own)
        rospy.logwarn("without it")
        """)
    assert [line for line in lines if line.startswith("own")] == [
        "own rosout WARNING hot 5",
        "own rosout.arm WARNING part",
        "own rosout.leg ERROR by Python",
        "own rosout WARNING once",
    ]
    assert len(lines) == 10
