from __future__ import annotations

import io
import logging
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from oracle import real
from simulation import SimulatedClock

from rosz.node.clock import Clock
from rosz.node.log import NodeLog

_MOMENT = 1700000000.123456
_FORMATS = [
    None,
    "[${severity}] [WallTime: ${walltime}] ${message}",
    "${node} ${logger} ${file}:${line} ${function}: ${message}",
    "${time:%H:%M:%S}/${walltime:%Y-%m-%d}/${time} ${message} ${time:%j}",
    "${other} $ {message} ${message ${message}${message} ${Line} {}%s",
    "",
]
_PROGRAM = '''
"""What both loggers are asked to say."""

def plain(log):
    log.debug("for developers")
    log.info("count %d of %s", 3, "many")
    log.info("100%")
    log.warn("careful: é")
    log.error("two\\nlines")
    log.fatal({"not": "a text"})

class Talker:
    def run(self, log):
        log.warn("from a method")
        (lambda: log.info("from a function in it"))()
        self.make(log)

    @staticmethod
    def make(log):
        log.info("from a static method")

def failing(log):
    try:
        raise ValueError("no")
    except ValueError:
        log.error("it failed", exc_info=True)

plain(log)
Talker().run(log)
failing(log)
'''
_ROSPY_CONSOLE = """
import io, logging, os, time, types
import rosmaster, rospy
import rosmaster.master, rosmaster.registrations

class Terminal(io.StringIO):
    def isatty(self):
        return True

master = rosmaster.master.Master(0)
master.start()
os.environ['ROS_MASTER_URI'] = master.uri
rospy.init_node('talker', log_level=rospy.DEBUG, disable_signals=True)
handler, = [h for h in logging.getLogger('rosout').handlers if hasattr(h, '_stdout')]
log = types.SimpleNamespace(debug=rospy.logdebug, info=rospy.loginfo, warn=rospy.logwarn,
                            error=rospy.logerr, fatal=rospy.logfatal)
moment = given['moment']
real_time, real_strftime = time.time, time.strftime
program = compile(open(given['program']).read(), given['program'], 'exec')
seen = []
for form in given['formats']:
    os.environ.pop('ROSCONSOLE_FORMAT', None)
    if form is not None:
        os.environ['ROSCONSOLE_FORMAT'] = form
    for ros_time in given['ros_times']:
        if ros_time is None:
            rospy.rostime.switch_to_wallclock()
        else:
            rospy.rostime._set_rostime(rospy.Time(0, ros_time))
        for kind in (io.StringIO, Terminal):
            handler._stdout, handler._stderr = kind(), kind()
            time.time = lambda: moment
            time.strftime = lambda form, at=None: real_strftime(form, at or time.localtime(moment))
            exec(program, {'log': log})
            time.time, time.strftime = real_time, real_strftime
            seen.append([handler._stdout.getvalue(), handler._stderr.getvalue()])
written = open(rospy.core._log_filename).read()
result = [seen, [line for line in written.splitlines() if line.startswith('[rosout]')
         and ' 2023-11-14 22:13:20,123: ' in line]]
"""


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def _utc(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


def freeze(record: logging.LogRecord) -> bool:
    """Have a record made at `_MOMENT`."""
    record.created = _MOMENT
    record.msecs = 123.0
    return True


def console(clock: Clock | None = None, **options: Any) -> NodeLog:
    log = NodeLog("/talker", clock=clock or Clock(), rosout=False, **options)
    log.addFilter(freeze)
    return log


def clock_at(ros_time: int | None) -> Clock:
    if ros_time is None:
        return Clock()
    return SimulatedClock(ros_time)


@pytest.mark.ros1
def test_console_and_file_are_rospys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "program.py"
    program.write_text(_PROGRAM)
    ros_times = [None, 0, 12_500_000_000, 1_700_000_000_123_456_789]
    question = {
        "moment": _MOMENT,
        "program": str(program),
        "formats": _FORMATS,
        "ros_times": ros_times,
    }
    expected, written = real(
        _ROSPY_CONSOLE, "rospy", "python3-rospy", given=question, home=str(tmp_path)
    )
    seen = []
    for text_format in _FORMATS:
        for ros_time in ros_times:
            for kind in (io.StringIO, Terminal):
                options = {} if text_format is None else {"console_format": text_format}
                log = console(
                    clock_at(ros_time), level=logging.DEBUG, log_dir=tmp_path / "ours", **options
                )
                out, err = kind(), kind()
                monkeypatch.setattr(sys, "stdout", out)
                monkeypatch.setattr(sys, "stderr", err)
                exec(compile(_PROGRAM, program, "exec"), {"log": log})
                monkeypatch.undo()
                log.close()
                seen.append([out.getvalue(), err.getvalue()])
    assert len(expected) == 48
    assert "\x1b[33m[WARN] [1700000000.123456]: careful" in expected[1][1]
    for ours, theirs in zip(seen, expected, strict=True):
        assert ours == theirs
    lines = (tmp_path / "ours" / "talker.log").read_text().splitlines()
    assert len(written) == 48 * 10
    assert [line for line in lines if line.startswith("[rosout]")] == written


def test_default_format(capsys: pytest.CaptureFixture[str]) -> None:
    log = console(SimulatedClock(12_500_000_000))
    log.info("hello %s", "world")
    log.error("bad")
    out, err = capsys.readouterr()
    assert out == "[INFO] [1700000000.123456, 12.500000]: hello world\n"
    assert err == "[ERROR] [1700000000.123456, 12.500000]: bad\n"


def test_tokens_in_a_message_stay(capsys: pytest.CaptureFixture[str]) -> None:
    console().info("${node} ${time:%H}")
    assert capsys.readouterr().out == "[INFO] [1700000000.123456]: ${node} ${time:%H}\n"


def test_controls_are_escaped_and_colours_are_not(capsys: pytest.CaptureFixture[str]) -> None:
    """Texts may be from strangers, as those of messages and errors are."""
    log = console(console_format="${message}")
    log.info("\x1b[1;32mgreen\x1b[0m\ttab\nline\r\nend\r")
    log.info("\x1b]0;title\x07\x1b[2J\x9b2J\x7f\rover")
    log.report("failed", ValueError("\x1b[A"))
    out, err = capsys.readouterr()
    first, second = out.split("end\r\n")
    assert first == "\x1b[1;32mgreen\x1b[0m\ttab\nline\r\n"
    assert second.rstrip("\n") == r"\u001b]0;title\u0007\u001b[2J\u009b2J\u007f\u000dover"
    assert err.endswith("ValueError: \\u001b[A\n")


def test_thread_and_logger_of_a_child(capsys: pytest.CaptureFixture[str]) -> None:
    console(console_format="${logger} ${thread}").child("driver").info("x")
    assert capsys.readouterr().out == f"rosout.driver {threading.get_ident()}\n"


def test_no_colours_where_not_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    console(color=False).error("bad")
    assert terminal.getvalue() == "[ERROR] [1700000000.123456]: bad\n"


def test_level_between_two_severities(capsys: pytest.CaptureFixture[str]) -> None:
    log = console(console_format="${severity}", level=1)
    for level in (1, 10, 25, 35, 99):
        log.log(level, "x")
    out, err = capsys.readouterr()
    assert (out, err) == ("DEBUG\nDEBUG\nINFO\n", "WARN\nFATAL\n")


def test_stream_of_a_narrow_encoding(monkeypatch: pytest.MonkeyPatch) -> None:
    narrow = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", narrow)
    console(console_format="${message}").info("é \udc80")
    narrow.seek(0)
    assert narrow.read() == "\\xe9 \\udc80\n"


class Broken(io.StringIO):
    name = "<stdout>"
    writes = 0

    def write(self, _text: str, /) -> int:
        self.writes += 1
        raise BrokenPipeError(32, "Broken pipe")


def test_broken_stream_is_given_up_with_one_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = Broken()
    log = console(console_format="${message}")
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", broken)
        log.info("one")
        log.info("two")
    log.info("three")
    out, err = capsys.readouterr()
    assert (
        err
        == "cannot log to <stdout>: [Errno 32] Broken pipe; what goes there is lost from now on\n"
    )
    assert out == "three\n"
    assert broken.writes == 1


def test_no_streams_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = io.StringIO()
    closed.close()
    monkeypatch.setattr(sys, "stderr", closed)
    monkeypatch.setattr(sys, "stdout", None)
    log = console()
    log.info("one")
    log.error("two")
    log.error("three")


def test_lines_are_flushed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BufferedWriter(raw), encoding="utf-8"))
    console(console_format="${message}").info("now")
    assert raw.getvalue() == b"now\n"


class Reentrant(io.StringIO):
    """A stream in whose first write a signal handler logs."""

    log: NodeLog
    writing = False

    def write(self, text: str, /) -> int:
        assert not self.writing
        self.writing = True
        if not self.tell():
            self.log.info("from the handler")
        self.writing = False
        return super().write(text)


def test_signal_handler_may_log_during_a_write(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Reentrant()
    stream.log = console(console_format="${message}")
    monkeypatch.setattr(sys, "stdout", stream)
    stream.log.info("from the program")
    assert stream.getvalue() == "from the program\nfrom the handler\n"


class Faulty(io.StringIO):
    def write(self, _text: str, /) -> int:
        raise LookupError("not foreseen")


def test_fault_of_a_stream_does_not_reach_the_program(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", Faulty())
    console().info("x")
    assert "LookupError: not foreseen" in capsys.readouterr().err
