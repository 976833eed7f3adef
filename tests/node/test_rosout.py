from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Iterator

import pytest
from network import TIMEOUT
from simulation import START, SimulatedClock

from rosz.errors import ClosedError
from rosz.node import log_handlers
from rosz.node.log import NodeLog


class Bench:
    """A log without console, and the lines that it publishes."""

    def __init__(self) -> None:
        self.clock = SimulatedClock()
        self.log = NodeLog("/ns/talker", clock=self.clock, console=False)
        self.lines: queue.Queue[tuple[object, ...]] = queue.Queue()

    def publish(self, *line: object) -> None:
        self.lines.put(line)

    def logged(self) -> list[str]:
        """Return a list that what is logged from now on is added to."""
        texts: list[str] = []

        def collect(record: logging.LogRecord) -> bool:
            texts.append(record.getMessage())
            return True

        self.log.addFilter(collect)
        return texts

    def messages(self) -> list[object]:
        """Return the messages published so far, all that is logged included."""
        self.log.flush()
        found = []
        while not self.lines.empty():
            found.append(self.lines.get()[2])
        return found


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(log_handlers, "_DRAIN_TIMEOUT", TIMEOUT)
    bench = Bench()
    yield bench
    bench.log.close()


def test_line_has_all_that_ros_wants(bench: Bench) -> None:
    bench.log.publish_to(bench.publish)

    class Talker:
        def run(self) -> None:
            bench.log.warning("low: %d %%", 7)

    Talker().run()
    line = bench.lines.get(timeout=TIMEOUT)
    assert line[:5] == (30, "ns.talker", "low: 7 %", __file__, "Talker.run")
    assert line[5] == Talker.run.__code__.co_firstlineno + 1
    assert line[6] == START


def test_child_has_its_name_below_the_nodes(bench: Bench) -> None:
    bench.log.publish_to(bench.publish)
    bench.log.child("arm").child("joint").error("stuck")
    assert bench.lines.get(timeout=TIMEOUT)[:3] == (40, "ns.talker.arm.joint", "stuck")


def test_time_is_that_of_logging_not_of_publishing(bench: Bench) -> None:
    bench.log.info("early")
    bench.clock.advance(START + 5)
    bench.log.publish_to(bench.publish)
    assert bench.lines.get(timeout=TIMEOUT)[6] == START


def test_message_is_filled_in_when_logged(bench: Bench) -> None:
    items = [1]
    bench.log.info("items %s", items)
    items.append(2)
    bench.log.publish_to(bench.publish)
    assert bench.messages() == ["items [1]"]


def test_what_was_logged_before_there_is_a_publisher_is_published(bench: Bench) -> None:
    bench.log.info("one")
    bench.log.info("two")
    bench.log.publish_to(bench.publish)
    bench.log.info("three")
    assert bench.messages() == ["one", "two", "three"]


def test_traceback_is_published(bench: Bench) -> None:
    bench.log.publish_to(bench.publish)
    try:
        int("no")
    except ValueError:
        bench.log.exception("it failed")
    (message,) = bench.messages()
    assert str(message).startswith("it failed\nTraceback (most recent call last):\n")
    assert str(message).endswith("literal for int() with base 10: 'no'")


@pytest.mark.parametrize(
    ("level", "severity"), [(1, 10), (10, 10), (19, 10), (25, 20), (50, 50), (99, 50)]
)
def test_severity_is_one_that_ros_knows(bench: Bench, level: int, severity: int) -> None:
    bench.log.setLevel(1)
    bench.log.publish_to(bench.publish)
    bench.log.log(level, "x")
    assert bench.lines.get(timeout=TIMEOUT)[0] == severity


def test_publishing_may_log_without_publishing_that(bench: Bench) -> None:
    console = bench.logged()

    def publish(*line: object) -> None:
        bench.log.info("publishing %s", line[2])
        bench.publish(*line)

    bench.log.publish_to(publish)
    bench.log.info("one")
    assert bench.messages() == ["one"]
    assert sorted(console) == ["one", "publishing one"]


def test_slow_publisher_does_not_hold_up_logging_and_misses_are_counted(bench: Bench) -> None:
    entered, proceed = threading.Event(), threading.Event()

    def publish(*line: object) -> None:
        entered.set()
        assert proceed.wait(TIMEOUT)
        bench.publish(*line)

    bench.log.publish_to(publish)
    bench.log.info("first")
    assert entered.wait(TIMEOUT)
    for number in range(log_handlers._CAPACITY + 7):
        bench.log.info("%d", number)
    proceed.set()
    messages = bench.messages()
    missing = "7 messages are missing here: more was logged than could be published"
    assert missing in messages
    messages.remove(missing)
    assert messages == ["first", *map(str, range(log_handlers._CAPACITY))]


def test_publishing_may_wait_for_a_thread_that_logs(bench: Bench) -> None:
    def publish(*line: object) -> None:
        if line[2] == "one":
            thread = threading.Thread(target=bench.log.info, args=("two",))
            thread.start()
            thread.join()
        bench.publish(*line)

    bench.log.publish_to(publish)
    bench.log.info("one")
    (sink,) = (each for each in bench.log.handlers if isinstance(each, log_handlers.RosoutHandler))
    # What logging does at the end of a program.
    sink.acquire()
    sink.flush()
    published = not bench.lines.empty()
    sink.release()
    assert published
    assert bench.messages() == ["one", "two"]


def test_failing_publisher_is_told_once_and_not_to_itself(bench: Bench) -> None:
    told = bench.logged()
    tried: queue.Queue[object] = queue.Queue()

    def publish(*line: object) -> None:
        tried.put(line[2])
        raise ValueError("no route")

    bench.log.publish_to(publish)
    bench.log.info("one")
    bench.log.info("two")
    bench.messages()
    assert [tried.get(timeout=TIMEOUT) for _ in range(2)] == ["one", "two"]
    assert tried.empty()
    assert sorted(told) == ["cannot publish the log on /rosout: no route", "one", "two"]


def test_a_publisher_that_ended_first_is_no_trouble(bench: Bench) -> None:
    told = bench.logged()
    tried: queue.Queue[object] = queue.Queue()

    def publish(*line: object) -> None:
        tried.put(line[2])
        raise ClosedError("the publisher is closed")

    bench.log.publish_to(publish)
    bench.log.info("one")
    bench.messages()
    assert tried.get(timeout=TIMEOUT) == "one"
    assert told == ["one"]


def test_closing_publishes_the_rest_and_ends_the_thread(bench: Bench) -> None:
    bench.log.publish_to(bench.publish)
    for number in range(100):
        bench.log.info("%d", number)
    bench.log.close()
    assert bench.messages() == [str(number) for number in range(100)]
    bench.log.close()
    bench.log.info("too late")
    assert bench.messages() == []
    assert not any("ns.talker" in thread.name for thread in threading.enumerate())


def test_closing_waits_for_a_stuck_publisher_only_so_long(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_handlers, "_DRAIN_TIMEOUT", 0.01)
    entered, proceed = threading.Event(), threading.Event()

    def publish(*_: object) -> None:
        entered.set()
        assert proceed.wait(TIMEOUT)

    bench.log.publish_to(publish)
    bench.log.info("one")
    assert entered.wait(TIMEOUT)
    bench.log.close()
    assert not proceed.is_set()
    proceed.set()


def test_publisher_may_close_the_log(bench: Bench) -> None:
    closed = threading.Event()

    def publish(*_: object) -> None:
        bench.log.close()
        closed.set()

    bench.log.publish_to(publish)
    bench.log.info("one")
    assert closed.wait(TIMEOUT)


def test_second_publisher_is_refused(bench: Bench) -> None:
    bench.log.publish_to(bench.publish)
    with pytest.raises(RuntimeError, match="already publishing"):
        bench.log.publish_to(bench.publish)


def test_log_without_rosout() -> None:
    log = NodeLog("/talker", clock=SimulatedClock(), console=False, rosout=False)
    log.publish_to(lambda *_: pytest.fail("published"))
    log.info("x")
    log.flush()
    log.close()


def test_filters_of_the_handler_apply(bench: Bench) -> None:
    bench.log.publish_to(bench.publish)
    for handler in bench.log.handlers:
        if isinstance(handler, log_handlers.RosoutHandler):
            handler.addFilter(lambda record: "secret" not in record.getMessage())
    bench.log.info("secret")
    bench.log.info("open")
    assert bench.messages() == ["open"]
