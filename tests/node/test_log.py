from __future__ import annotations

import logging
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from simulation import SECOND, START, SimulatedClock

from rosz.errors import NotFoundError, UsageError
from rosz.node.clock import Clock
from rosz.node.log import NodeLog, NodeLogger
from rosz.node.log_handlers import parse_severity, severity_name


class Collect(logging.Handler):
    """Keeps records."""

    def __init__(self) -> None:
        super().__init__()
        self.records: list[logging.LogRecord] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.records.append(record)

    @property
    def texts(self) -> list[str]:
        return [record.getMessage() for record in self.records]


def make(clock: Clock | None = None, **options: Any) -> tuple[NodeLog, Collect]:
    log = NodeLog(
        "/ns/talker", clock=clock or SimulatedClock(), console=False, rosout=False, **options
    )
    collect = Collect()
    log.addHandler(collect)
    return log, collect


def test_each_method_has_its_level() -> None:
    log, seen = make(level=logging.DEBUG)
    methods: list[Callable[..., None]] = [
        log.debug,
        log.info,
        log.warn,
        log.warning,
        log.error,
        log.critical,
        log.fatal,
    ]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for method in methods:
            method("%s-%s", "a", 1)
    assert [record.levelno for record in seen.records] == [10, 20, 30, 30, 40, 50, 50]
    assert set(seen.texts) == {"a-1"}
    assert not caught


def test_level_keeps_out_and_spares_the_formatting() -> None:
    log, seen = make()

    class Costly:
        def __str__(self) -> str:
            raise AssertionError("formatted")

    log.debug("%s", Costly())
    log.log(19, Costly())
    assert not seen.records
    assert log.isEnabledFor(logging.INFO)
    assert not log.isEnabledFor(logging.DEBUG)


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (("100%",), "100%"),
        (("%d %%", 3), "3 %"),
        (("%(a)s", {"a": 1}), "1"),
        (("%s", {}), "{}"),
        (("%s", ()), "()"),
        (({"not": "text"},), "{'not': 'text'}"),
    ],
)
def test_messages_are_filled_in_as_by_logging(args: tuple[Any, ...], text: str) -> None:
    log, seen = make()
    log.info(*args)
    log.info(*args, throttle_identical=0)
    assert seen.texts == [text, text]
    assert logging.LogRecord("x", 20, "", 1, args[0], args[1:], None).getMessage() == text


def test_message_that_does_not_go_with_its_arguments_says_so() -> None:
    log, seen = make()

    class Bad:
        def __str__(self) -> str:
            raise ValueError("no text")

    log.info("%d apples", "three")
    log.info(Bad())
    assert seen.texts[0].startswith("message '%d apples' cannot be filled in with (str): ")
    assert seen.texts[1] == "message of type Bad cannot be filled in with (): no text"


def test_record_says_who_called() -> None:
    log, seen = make()

    def wrapper() -> None:
        log.warning("x", stacklevel=2)

    log.info("x")
    wrapper()
    log.report("x", ValueError("no"))
    log.child("a").log(20, "x", throttle=0)
    log.exception("x")  # noqa: LOG004  # whence it comes is what matters
    assert {(record.filename, record.funcName) for record in seen.records} == {
        ("test_log.py", "test_record_says_who_called")
    }
    first = test_record_says_who_called.__code__.co_firstlineno
    assert [record.lineno - first for record in seen.records] == [6, 7, 8, 9, 10]


def test_methods_are_named_with_their_class() -> None:
    log, seen = make()

    class Talker:
        def run(self) -> None:
            log.info("x")

    Talker().run()
    assert seen.records[0].funcName == "Talker.run"


def test_stack_can_be_shown() -> None:
    log, seen = make()
    log.info("x", stack_info=True)
    stack = seen.records[0].stack_info
    assert stack is not None
    assert stack.startswith("Stack (most recent call last):\n")
    assert stack.endswith('log.info("x", stack_info=True)')


def test_errors_are_shown_with_their_traceback() -> None:
    log, seen = make()
    error = ValueError("100% bad")
    log.report("callback '%s' failed", error)
    assert seen.texts == ["callback '%s' failed"]
    assert seen.records[0].exc_info is not None
    assert seen.records[0].exc_info[1] is error


def test_once() -> None:
    log, seen = make()
    for number in range(3):
        log.info("a %d", number, once=True)
        log.child("part").warning("b %d", number, once=True)
    assert seen.texts == ["a 0", "b 0"]


def test_two_calls_in_a_line_are_told_apart() -> None:
    log, seen = make()
    for _ in range(2):
        (log.info("a", once=True), log.info("b", once=True))  # type: ignore[func-returns-value]
    assert seen.texts == ["a", "b"]


def test_once_is_not_used_up_below_the_level() -> None:
    log, seen = make()
    for level in ("WARN", "INFO"):
        log.set_level("", level)
        log.info("a", once=True)
        if level == "INFO":
            log.info("b", once=True)
    assert seen.texts == ["a", "b"]


def test_throttle_goes_by_the_clock_as_in_rospy() -> None:
    clock = SimulatedClock()
    log, seen = make(clock)
    moments = [0, 1, SECOND, SECOND + 1, 2 * SECOND + 1, 2 * SECOND + 2]
    for moment in moments:
        clock.advance(START + moment)
        log.info("%d", moment, throttle=1.0)
    assert seen.texts == [str(moments[0]), str(moments[3]), str(moments[5])]


def test_throttle_starts_over_when_time_moves_back() -> None:
    clock = SimulatedClock()
    log, seen = make(clock)
    for moment in (START, 1, 2):
        clock.advance(moment)
        log.info("%d", moment, throttle=60)
    assert seen.texts == [str(START), "1"]


def test_throttle_in_wall_time() -> None:
    log, seen = make(Clock())
    for number in range(3):
        log.info("%d", number, throttle=3600)
    assert seen.texts == ["0"]


def test_identical_texts_are_throttled() -> None:
    clock = SimulatedClock()
    log, seen = make(clock)
    for step, text in enumerate(["a", "a", "b", "b", "a", "a", "a"]):
        clock.advance(START + step * SECOND)
        log.info("say %s", text, throttle_identical=4.5)
    assert seen.texts == ["say a", "say b", "say a", "say a"]


def test_texts_are_compared_with_their_arguments_filled_in() -> None:
    log, seen = make()
    for number in (1, 1, 2):
        log.info("%(n)d", {"n": number}, throttle_identical=3600)
        log.info("-%d", number, throttle_identical=3600)
    assert seen.texts == ["1", "-1", "2", "-2"]


def test_throttle_by_the_line_of_a_wrapper_s_caller() -> None:
    log, seen = make()

    def warn_once(text: str) -> None:
        log.warning(text, once=True, stacklevel=2)

    for _ in range(2):
        warn_once("a")
        warn_once("b")
    assert seen.texts == ["a", "b"]


def test_levels_of_parts() -> None:
    log, seen = make()
    arm = log.child("arm")
    joint = arm.child("joint")
    assert isinstance(joint, NodeLogger)
    assert log.child("arm") is log.getChild("arm") is arm
    assert log.get_levels() == {"rosout": "INFO", "rosout.arm": "INFO", "rosout.arm.joint": "INFO"}
    log.set_level("arm", "debug")
    joint.debug("joint")
    log.debug("node")
    log.set_level("rosout.arm.joint", "FATAL")
    joint.error("joint")
    assert seen.texts == ["joint"]
    assert log.get_levels() == {
        "rosout": "INFO",
        "rosout.arm": "DEBUG",
        "rosout.arm.joint": "FATAL",
    }


@pytest.mark.parametrize("name", ["", "rosout", "ns.talker"])
def test_names_of_the_node_s_own_logger(name: str) -> None:
    log, _ = make()
    log.set_level(name, "Warn")
    assert log.get_levels() == {"rosout": "WARN"}


@pytest.mark.parametrize("name", ["arm.joint", "rosout.arm.joint", "ns.talker.arm.joint"])
def test_names_of_a_part_s_logger(name: str) -> None:
    log, _ = make()
    log.child("arm.joint")
    log.set_level(name, "ERROR")
    assert log.get_levels() == {"rosout": "INFO", "rosout.arm.joint": "ERROR"}


def test_unknown_logger_and_level() -> None:
    log, _ = make()
    log.child("arm")
    with pytest.raises(NotFoundError, match=r"no logger 'rosuot': .*; did you mean 'rosout'"):
        log.set_level("rosuot", "DEBUG")
    with pytest.raises(
        NotFoundError, match=r"no logger 'leg': expected one of rosout, rosout\.arm"
    ):
        log.set_level("leg", "DEBUG")
    with pytest.raises(UsageError, match=r"'debgu' is not a level: .* FATAL; did you mean 'DEBUG'"):
        log.set_level("rosout", "debgu")


def test_severities() -> None:
    assert [parse_severity(name) for name in ("debug", "Info", "WARN", "warning", "error")] == [
        10,
        20,
        30,
        30,
        40,
    ]
    assert parse_severity("fatal") == parse_severity("CRITICAL") == 50
    assert [severity_name(level) for level in (0, 10, 29, 30, 100)] == [
        "DEBUG",
        "DEBUG",
        "INFO",
        "WARN",
        "FATAL",
    ]


def test_nodes_of_one_name_do_not_share_a_log() -> None:
    (one, seen_one), (two, seen_two) = make(), make()
    one.set_level("", "ERROR")
    two.child("arm")
    one.info("x")
    two.info("y")
    assert not seen_one.records
    assert seen_two.texts == ["y"]
    assert one.get_levels() == {"rosout": "ERROR"}


def test_where_the_file_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    clock = Clock()
    options: dict[str, Any] = {"clock": clock, "console": False}
    assert NodeLog("/a/b", **options).file is None
    assert NodeLog("/a/b", log_dir=Path("/logs"), **options).file == Path("/logs/a-b.log")
    given = NodeLog("/a/b", log_dir=Path("/logs"), file_name="x/y.log", **options)
    assert given.file == tmp_path / "x" / "y.log"


def test_console_goes_on_after_closing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = NodeLog("/talker", clock=Clock(), log_dir=tmp_path, console_format="${message}")
    log.info("one")
    log.close()
    log.close()
    log.info("two")
    assert capsys.readouterr().out == "one\ntwo\n"
    assert log.file is not None
    assert log.file.read_text().count("\n") == 1


def test_log_with_nowhere_to_go_is_silent(capsys: pytest.CaptureFixture[str]) -> None:
    NodeLog("/talker", clock=Clock(), console=False, rosout=False).error("x")
    assert capsys.readouterr() == ("", "")


def test_unwritable_file_is_told_once_on_the_console(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    log = NodeLog("/talker", clock=Clock(), log_dir=tmp_path / "file", console_format="${message}")
    log.child("arm").info("one")
    log.info("two")
    log.close()
    out, err = capsys.readouterr()
    assert out == "one\ntwo\n"
    assert err.startswith(f"cannot write log file '{tmp_path}/file/talker.log': ")
    assert err.count("\n") == 1


def _state_of_logging() -> dict[str, object]:
    root = logging.getLogger()
    loggers = {
        name: (logger.level, logger.disabled, logger.propagate, list(logger.handlers))
        for name, logger in root.manager.loggerDict.items()
        if isinstance(logger, logging.Logger)
    }
    return {
        "class": logging.getLoggerClass(),
        "factory": logging.getLogRecordFactory(),
        "disable": root.manager.disable,
        "root": (root.level, root.disabled, list(root.handlers), list(root.filters)),
        "loggers": loggers,
        "names": {level: logging.getLevelName(level) for level in range(60)},
        "raise": logging.raiseExceptions,
    }


def test_the_program_s_own_logging_is_left_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    mine = logging.getLogger("my.library")
    before = _state_of_logging()
    log = NodeLog("/talker", clock=Clock(), log_dir=tmp_path, console=False)
    log.child("arm").warning("x")
    log.set_level("arm", "DEBUG")
    log.publish_to(lambda *_: None)
    mine.warning("mine")
    log.close()
    assert _state_of_logging() == before
    assert caplog.messages == ["mine"]


def test_the_program_s_configuration_leaves_the_log_alone(tmp_path: Path) -> None:
    """Whole programs, because they change logging for good."""
    program = """
import logging, logging.config, pathlib, sys
from rosz.node.clock import Clock
from rosz.node.log import NodeLog

lines = []
log = NodeLog("/talker", clock=Clock(), log_dir=pathlib.Path(sys.argv[1]),
              console_format="node ${message}")
log.publish_to(lambda *line: lines.append(line[2]))
logging.getLogger("old")
log.info("before")
logging.config.dictConfig({
    "version": 1,
    "formatters": {"f": {"format": "%(name)s %(message)s"}},
    "handlers": {"h": {"class": "logging.StreamHandler", "formatter": "f",
                       "stream": "ext://sys.stdout"}},
    "root": {"level": "DEBUG", "handlers": ["h"]},
})
log.info("after")
logging.disable(logging.CRITICAL)
log.info("disabled")
logging.disable(logging.NOTSET)
logging.getLogger("new").debug("mine")
log.close()
print(lines)
"""
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path],
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert done.stderr == ""
    assert done.stdout == (
        "node before\nnode after\nnode disabled\nnew mine\n['before', 'after', 'disabled']\n"
    )
    written = (tmp_path / "talker.log").read_text().splitlines()
    assert [line.rpartition(": ")[2] for line in written] == ["before", "after", "disabled"]


def test_exit_without_closing_publishes_what_was_logged() -> None:
    program = """
import time
from rosz.node.clock import Clock
from rosz.node.log import NodeLog

log = NodeLog("/talker", clock=Clock(), console=False)
log.publish_to(lambda *line: (time.sleep(0.01), print(line[2], flush=True)))
for number in range(5):
    log.info("%d", number)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=50, check=False
    )
    assert (done.stdout, done.stderr) == ("0\n1\n2\n3\n4\n", "")
