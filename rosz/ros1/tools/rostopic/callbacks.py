"""rostopic: callbacks that show messages, or measure rates, delays and bandwidths of topics."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from rosz import introspect
from rosz.message import strify_message
from rosz.ros1.client import rospy
from rosz.ros1.state import ready_context
from rosz.ros1.tools.rostopic.topics import FieldReader, msgevalgen

_CLEAR = "\033[2J\033[;H"

FieldFilter = Callable[[Any], Iterable[str]]
"""Function that returns the names of the fields of a message to show."""

Stats = tuple[float, float, float, float, int]
"""Rate in Hz or delay in seconds; least, largest and standard deviation in seconds; count."""


def create_field_filter(echo_nostr: bool, echo_noarr: bool) -> FieldFilter:
    """Return a function that returns the names of the fields of a message to show.

    Args:
        echo_nostr: Whether to leave out strings.
        echo_noarr: Whether to leave out arrays.
    """

    def shown(message: Any) -> Iterator[str]:
        for name, type_name in zip(message.__slots__, message._slot_types, strict=True):
            if not (echo_noarr and "[" in type_name) and not (echo_nostr and "string" in type_name):
                yield name

    return shown


def create_value_transform(echo_nostr: bool, echo_noarr: bool) -> Callable[..., Any]:
    """Return a function that returns a message with notes in place of strings or arrays.

    The arguments are those of `create_field_filter`.
    """

    def transform(val: Any, type_information: str | None = None) -> Any:
        return introspect.shorten(val, type_information or "", echo_noarr, echo_nostr)

    return transform


def _all_fields(message: Any) -> Iterable[str]:
    names: Iterable[str] = message.__slots__
    return names


def _str_plot_fields(val: Any, f: str, field_filter: FieldFilter | None) -> str:
    return f"time,{','.join(introspect.plot_columns(val, f, field_filter or _all_fields))}"


def _str_plot(
    val: Any,
    time_offset: Any = None,
    current_time: Any = None,
    field_filter: FieldFilter | None = None,
    **_: object,
) -> str:
    """Return a message as a row of values, with its time first."""
    offset = 0 if time_offset is None else time_offset.to_nsec()
    if current_time is None:
        stamped = getattr(val, "_has_header", False)
        current_time = val.header.stamp if stamped else rospy.get_rostime()
    values = introspect.plot_values(val, offset, field_filter or _all_fields)
    return f"{current_time.to_nsec() - offset},{','.join(values)}"


class CallbackEcho:
    """Writes messages to stdout: `callback` is a callback for subscribers.

    Args:
        topic: Name of the topic; the path of a field may follow.
        msg_eval: Function that reads the field to show; None for whole messages.
        plot: Whether to write rows of values.
        filter_fn: Function of a message that returns whether to show it.
        echo_clear: Whether to clear the screen before each message.
        echo_all_topics: Whether to show the messages of other topics as well.
        offset_time: Whether to show times as seconds from now.
        count: Number of messages to show; no limit when not given.
        field_filter_fn: Function that returns the names of the fields of a message to show.
        fixed_numeric_width: Width of numbers in characters.
        value_transform_fn: Function that returns the value to show for a message.

    Attributes:
        done: Whether all messages have been shown, or nobody reads stdout any more.
    """

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        topic: str,
        msg_eval: FieldReader | None,
        plot: bool = False,
        filter_fn: Callable[[Any], bool] | None = None,
        echo_clear: bool = False,
        echo_all_topics: bool = False,
        offset_time: bool = False,
        count: int | None = None,
        field_filter_fn: FieldFilter | None = None,
        fixed_numeric_width: int | None = None,
        value_transform_fn: Callable[..., Any] | None = None,
    ) -> None:
        self.topic = topic.removesuffix("/") if topic else topic
        self.msg_eval = msg_eval
        self.plot = plot
        self.filter_fn = filter_fn
        self.echo_all_topics = echo_all_topics
        self.offset_time = offset_time
        self.max_count = count
        self.field_filter = field_filter_fn
        self.fixed_numeric_width = fixed_numeric_width
        self.value_transform = value_transform_fn
        self.prefix = _CLEAR if echo_clear and not plot else ""
        self.suffix = "" if plot else "\n---"
        self.count = 0
        self.first = True
        self.done = False

    def callback(
        self, data: Any, callback_args: Mapping[str, Any], current_time: Any = None
    ) -> None:
        """Show a message.

        Args:
            data: The message.
            callback_args: ``topic``, its name, and maybe ``type_information``, the type of the
                field to show.
            current_time: Time of the message; that of its header, or now, when not given.
        """
        topic = callback_args["topic"]
        if self.filter_fn is not None and not self.filter_fn(data):
            return
        read = self.msg_eval
        if topic != self.topic:
            if self.topic.startswith(f"{topic}/"):
                read = msgevalgen(self.topic[len(topic) :])
            elif not self.echo_all_topics:
                return
        value = data if read is None else read(data)
        if value is not None and not self._is_complete():
            self.count += 1
            self._write(value, callback_args.get("type_information") or "", current_time)
        self.done = self.done or self._is_complete()

    def _is_complete(self) -> bool:
        return self.max_count is not None and self.count >= self.max_count

    def _write(self, value: Any, type_name: str, current_time: Any) -> None:
        offset = rospy.get_rostime() if self.offset_time else None
        head = ""
        if self.plot:
            if self.first:
                head = f"%{_str_plot_fields(value, 'field', self.field_filter)}\n"
            text = _str_plot(value, offset, current_time, self.field_filter)
        else:
            text = self._yaml(value, type_name, offset)
        self.first = False
        try:
            sys.stdout.write(f"{head}{self.prefix}{text}{self.suffix}\n")
            sys.stdout.flush()
        except OSError:  # nobody reads it any more
            self.done = True

    def _yaml(self, value: Any, type_name: str, offset: Any) -> str:
        if self.value_transform is not None:
            value = self.value_transform(value, type_name)
        return strify_message(
            value,
            time_offset=offset,
            field_filter=self.field_filter,
            fixed_numeric_width=self.fixed_numeric_width,
        )


class ROSTopicHz:
    """Measures rates of topics: `callback_hz` is a callback for subscribers.

    Args:
        window_size: Number of messages to average; 50 000 if negative.
        filter_expr: Function of a message that returns whether to count it.
        use_wtime: Whether to use wall time even in simulation.
    """

    def __init__(
        self,
        window_size: int,
        filter_expr: Callable[[Any], bool] | None = None,
        use_wtime: bool = False,
    ) -> None:
        self.window_size = window_size
        self.filter_expr = filter_expr
        self.use_wtime = use_wtime
        self._meters: dict[str | None, introspect.RateMeter] = {}

    def _meter(self, topic: str | None) -> introspect.RateMeter:
        meter = self._meters.get(topic)
        if meter is None:
            window = None if self.window_size < 0 else self.window_size
            meter = self._meters.setdefault(topic, introspect.RateMeter(window))
        return meter

    def callback_hz(self, m: Any, topic: str | None = None) -> None:
        """Count a message.

        Args:
            m: The message.
            topic: Name of the topic.
        """
        if self.filter_expr is not None and not self.filter_expr(m):
            return
        now = time.time_ns() if self.use_wtime else ready_context().clock.now()
        self._meter(topic).tick(now)

    def get_hz(self, topic: str | None = None) -> Stats | None:
        """Return the measured rate, or None if there are no new messages since the last call."""
        stats = self._meter(topic).stats()
        if stats is None:
            return None
        return stats.rate, stats.min_delta, stats.max_delta, stats.std_dev, stats.window

    def print_hz(self, topics: Iterable[str | None] = (None,)) -> None:
        """Write the measured rates to stdout."""
        names = list(topics)
        if len(names) == 1:
            text = introspect.format_rate(self._meter(names[0]).stats())
        else:
            text = introspect.format_rates({str(name): self._meter(name).stats() for name in names})
        sys.stdout.write(f"{text}\n")


class ROSTopicDelay:
    """Measures how old messages are when they arrive: `callback_delay` is a callback.

    Args:
        window_size: Number of messages to average; 50 000 if negative.
    """

    def __init__(self, window_size: int) -> None:
        self.window_size = window_size
        self._meter = introspect.DelayMeter(None if window_size < 0 else window_size)

    def callback_delay(self, msg: Any) -> None:
        """Count a message; one without a header is an error of the log."""
        if not msg._has_header:
            rospy.logerr("msg does not have header")
            return
        self._meter.add(msg.header.stamp.to_nsec(), ready_context().clock.now())

    def get_delay(self) -> Stats | None:
        """Return the measured delay, or None if there are no new messages since the last call."""
        stats = self._meter.stats()
        if stats is None:
            return None
        return stats.mean, stats.min_delay, stats.max_delay, stats.std_dev, stats.window

    def print_delay(self) -> None:
        """Write the measured delay to stdout, once there is one."""
        if self._meter.begun:
            sys.stdout.write(f"{introspect.format_delay(self._meter.stats())}\n")


class ROSTopicBandwidth:
    """Measures bytes per second: `callback` is a callback for subscribers to ``rospy.AnyMsg``.

    Args:
        window_size: Number of messages to average.
    """

    def __init__(self, window_size: int = 100) -> None:
        self.window_size = window_size or 100
        self._meter = introspect.BandwidthMeter(self.window_size)

    def callback(self, data: Any) -> None:
        """Count a message."""
        self._meter.add(len(data._buff), time.monotonic_ns())  # noqa: SLF001  # ROS 1's

    def print_bw(self) -> None:
        """Write the measured bandwidth to stdout, once there are two messages."""
        stats = self._meter.stats(time.monotonic_ns())
        if stats is not None:
            sys.stdout.write(f"{introspect.format_bandwidth(stats)}\n")
