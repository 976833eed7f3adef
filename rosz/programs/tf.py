"""The programs of tf, tf2_ros and tf2_tools: publish, print and draw transforms."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from rosz.errors import ParamNotFound, RoszError, TransformError, UsageError
from rosz.message import from_plain
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node, serve_loggers
from rosz.remap import parse
from rosz.transforms import (
    Buffer,
    Monitor,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
    describe_pose,
    from_rpy,
    tree_as_dot,
)

_NANOSECONDS = 1_000_000_000
_LEADING_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_WRONG_WORDS = 255  # ROS 1's programs return -1
_MILLISECONDS = 1000
_EULER, _QUATERNION = 6, 7
_MOST_DIGITS = 99
_FIRST_TIMEOUT = _NANOSECONDS
_LISTEN_SECONDS = 5.0  # as in ROS 1
_MONITOR_SECONDS = 0.2

_TF_USAGE = """\
usage: static_transform_publisher x y z yaw pitch roll frame_id child_frame_id period_in_ms
       static_transform_publisher x y z qx qy qz qw frame_id child_frame_id period_in_ms
Publishes the transform on /tf, again after each period."""
_TF2_USAGE = """\
usage: static_transform_publisher x y z yaw pitch roll frame_id child_frame_id
       static_transform_publisher x y z qx qy qz qw frame_id child_frame_id
       static_transform_publisher PARAMETER
Publishes the transform on /tf_static once; late subscribers get it too."""
_ECHO_USAGE = """\
usage: tf_echo SOURCE_FRAME TARGET_FRAME [RATE]
Prints the pose of the target frame in the source frame, RATE times a second (1)."""
_MONITOR_USAGE = "usage: tf_monitor [FRAME FRAME]"


def _refuse(text: str) -> NoReturn:
    """End with the exit code of the programs of ROS 1 for wrong words."""
    sys.stderr.write(f"{text}\n")
    sys.exit(_WRONG_WORDS)


def _numbers(words: Sequence[str], read: Callable[[str], float] = float) -> list[float]:
    try:
        return [read(word) for word in words]
    except ValueError as error:
        raise UsageError(f"{error}; expected a number") from error


def leading_number(word: str) -> float:
    """Return the number that a word begins with, as C's ``atof`` reads ``0,`` and ``.5m``."""
    match = _LEADING_NUMBER.match(word)
    return float(match[0] if match else word)


def _positive(what: str, word: str) -> float:
    number = _numbers([word])[0]
    if not number > 0:
        raise UsageError(f"{what} is {word}; expected above 0")
    return number


def _few(words: Sequence[str]) -> Sequence[str]:
    """Return two frames, and a rate if it is given."""
    if not 2 <= len(words) <= 3:  # noqa: PLR2004
        raise UsageError(f"got {len(words)} arguments, expected two frames, and maybe a rate")
    return words


def parse_transform(words: Sequence[str], read: Callable[[str], float] = float) -> TransformStamped:
    """Return the transform that a command line describes, without a time.

    Args:
        words: ``x y z yaw pitch roll frame child`` in metres and radians, or
            ``x y z qx qy qz qw frame child``.
        read: Function that reads a number, and raises ValueError if it is none.
    """
    if len(words) not in {_EULER + 2, _QUATERNION + 2}:
        raise UsageError(f"got {len(words)} arguments, expected {_EULER + 2} or {_QUATERNION + 2}")
    *texts, parent, child = words
    if parent == child:
        raise UsageError(f"the frame and its child are both '{child}'; expected two frames")
    numbers = _numbers(texts, read)
    if len(numbers) == _EULER:
        x, y, z, yaw, pitch, roll = numbers
        rotation = from_rpy(roll, pitch, yaw)
    else:
        x, y, z, *quaternion = numbers
        rotation = (quaternion[0], quaternion[1], quaternion[2], quaternion[3])
    transform = Transform(Vector3(x, y, z), Quaternion(*rotation))
    return TransformStamped(Header(frame_id=parent), child, transform)


def static_transform_publisher() -> None:
    """Publish a transform on ``/tf`` again and again, as the program of tf does."""
    words = list(parse(sys.argv[1:]).rest)
    if len(words) not in {_EULER + 3, _QUATERNION + 3}:
        wrong = f"got {len(words)} arguments, expected {_EULER + 3} or {_QUATERNION + 3}"
        _refuse(f"static_transform_publisher: {wrong}\n{_TF_USAGE}")
    try:
        transform = parse_transform(words[:-1], leading_number)
        period = _positive("the period in ms", words[-1]) / _MILLISECONDS
    except UsageError as error:
        _refuse(f"static_transform_publisher: {error}\n{_TF_USAGE}")
    with Node("static_transform_publisher", anonymous=True) as node:
        serve_loggers(node)
        broadcaster = TransformBroadcaster(node)
        ahead = round(period * _NANOSECONDS)
        while not node.is_shutdown:
            # Its time is ahead, so that it is valid until the next one comes.
            transform.header.stamp = Time.from_nsec(node.now() + ahead)
            broadcaster.send(transform)
            node.sleep(period)


def static_transform_publisher_of_tf2() -> None:
    """Publish a transform on ``/tf_static``, as the program of tf2_ros does."""
    words = list(parse(sys.argv[1:]).rest)
    with Node("static_transform_publisher", anonymous=True) as node:
        serve_loggers(node)
        try:
            transform = (
                _of_param(node, words[0])
                if len(words) == 1
                else parse_transform(words, leading_number)
            )
        except RoszError as error:
            _refuse(f"static_transform_publisher: {_phrase(words, error)}\n{_TF2_USAGE}")
        transform.header.stamp = Time.from_nsec(node.now())
        StaticTransformBroadcaster(node).send(transform)
        node.log.info(
            "Spinning until killed publishing %s to %s",
            transform.header.frame_id,
            transform.child_frame_id,
        )
        node.spin()


def _phrase(words: Sequence[str], error: RoszError) -> str:
    """Return the text of an error with the words of ROS 1's program, which scripts look for."""
    if len(words) == 1:
        unread = isinstance(error, ParamNotFound)
        what = "read TF from parameter server" if unread else "validate XmlRpcC for TF data"
        return f"Could not {what}: {error}"
    if len(words) in {_EULER + 2, _QUATERNION + 2}:
        return str(error)
    return f"exited due to not having the right number of arguments: {error}"


def _of_param(node: Node, name: str) -> TransformStamped:
    """Return the transform in a parameter."""
    value: Any = node.params.get(name)
    if not isinstance(value, dict):
        raise UsageError(f"parameter '{name}' is {value!r:.60}; expected a TransformStamped")
    transform: TransformStamped = from_plain(TransformStamped, value)
    return transform


def tf_echo() -> None:
    """Print the transform between two frames periodically."""
    words = list(parse(sys.argv[1:]).rest)
    with Node("tf_echo", anonymous=True) as node:
        try:
            source, target, *rest = (word.removeprefix("/") for word in _few(words))
            rate = _positive("the rate", *rest or [str(node.params.get("~rate", 1.0))])
        except UsageError as error:
            _refuse(f"tf_echo: {error}\n{_ECHO_USAGE}")
        digits = node.params.get("~precision", 3)
        if not (isinstance(digits, int | float) and 0 <= digits <= _MOST_DIGITS):
            _refuse(f"tf_echo: ~precision is {digits!r}; expected from 0 to {_MOST_DIGITS}")
        buffer = Buffer()
        TransformListener(buffer, node)
        buffer.wait(lambda: not buffer.why_not(source, target), _FIRST_TIMEOUT, node.clock)
        for _ in node.rate(rate):
            _print(_echoed(buffer, source, target, node, int(digits)))


def _print(text: str) -> None:
    """Print a text; end the program if nobody reads its output any more."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes the output again at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)


def _echoed(buffer: Buffer, source: str, target: str, node: Node, precision: int) -> str:
    try:
        pose, stamp = buffer.lookup(source, target)
    except TransformError as error:
        now = node.now() / _NANOSECONDS
        listing = "".join(
            f"Frame {name} exists with parent {history.newest.parent}.\n"
            for name, history in buffer.histories().items()
        )
        return (
            f"Failure at {now:.9f}\nException thrown:{error}\n"
            f"The current list of frames is:\n{listing}\n"
        )
    return "".join(f"{line}\n" for line in describe_pose(pose, stamp, precision))


def tf_monitor() -> None:
    """Print again and again by whom, how often and how late frames are published."""
    words = [word.removeprefix("/") for word in list(parse(sys.argv[1:]).rest)]
    if len(words) not in {0, 2}:
        _refuse(f"tf_monitor: expected no frames or two\n{_MONITOR_USAGE}")
    with Node("tf_monitor", anonymous=True) as node:
        monitor = Monitor(node)
        while node.sleep(_MONITOR_SECONDS):
            _print(_monitored(monitor, words, node.now()))


def _monitored(monitor: Monitor, words: Sequence[str], now: int) -> str:
    title = f"{words[0]} to {words[1]}" if words else "all Frames"
    lines = ["", "", "", f"RESULTS: for {title}"]
    wanted: list[str] | None = None
    if words:
        try:
            wanted = monitor.buffer.chain(words[1], words[0])
            _, stamp = monitor.buffer.lookup(words[0], words[1])
        except TransformError as error:
            return "".join(f"{line}\n" for line in [*lines, f"Waiting for the transform: {error}"])
        delay = (now - stamp) / _NANOSECONDS if stamp else 0.0
        lines += [f"Chain is: {' -> '.join(wanted)}", f"Net delay     {delay:g}"]
    lines += ["", "Frames:"]
    lines += (
        f"Frame: {report.frame} published by {report.node}{'(static)' * report.static}"
        f" Average Delay: {report.mean_delay:g} Max Delay: {report.max_delay:g}"
        for report in monitor.frames()
        if wanted is None or report.frame in wanted
    )
    lines += ["", "All Broadcasters:"]
    lines += (
        f"Node: {report.node} {report.rate:g} Hz,"
        f" Average Delay: {report.mean_delay:g} Max Delay: {report.max_delay:g}"
        for report in monitor.broadcasters()
    )
    return "".join(f"{line}\n" for line in lines)


def view_frames() -> None:
    """Draw the tree of frames: ``frames.gv``, and with Graphviz ``frames.pdf`` and ``.svg``."""
    with Node("view_frames", anonymous=True) as node:
        monitor = Monitor(node)
        sys.stdout.write(f"Listening to /tf for {_LISTEN_SECONDS:.1f} seconds\n")
        sys.stdout.flush()
        node.sleep(_LISTEN_SECONDS)
        frames = monitor.frames()
    if not frames:
        sys.exit("view_frames: no transforms have come")
    source = Path("frames.gv")
    dot = shutil.which("dot")
    try:
        source.write_text(tree_as_dot(frames, _LISTEN_SECONDS), encoding="utf-8")
        if dot:
            outputs = ("-Tpdf", "-oframes.pdf", "-Tsvg", "-oframes.svg")
            subprocess.run([dot, *outputs, str(source)], check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        sys.exit(f"view_frames: cannot draw '{source}': {error}")
    sys.stdout.write(f"{source}{', frames.pdf, frames.svg' if dot else ''} generated\n")
    if not dot:
        sys.exit("view_frames: without Graphviz there is no picture: apt install graphviz")
