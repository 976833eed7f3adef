"""rostopic: messages as text."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from rosz.introspect.echo import plot_columns, plot_values, shorten
from rosz.message.text import strify_message
from rosz.ros1 import rospy
from rosz.ros1.rostopic.topics import FieldReader, msgevalgen

__all__ = ("CallbackEcho", "create_field_filter", "create_value_transform")

_CLEAR = "\033[2J\033[;H"

FieldFilter = Callable[[Any], Iterable[str]]
"""Function that returns the names of the fields of a message to show."""


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

    Args:
        echo_nostr: Whether to replace strings.
        echo_noarr: Whether to replace arrays.
    """

    def transform(val: Any, type_information: str | None = None) -> Any:
        return shorten(val, type_information or "", echo_noarr, echo_nostr)

    return transform


def _all_fields(message: Any) -> Iterable[str]:
    found: Iterable[str] = message.__slots__
    return found


def _str_plot_fields(val: Any, f: str, field_filter: FieldFilter | None) -> str:
    """Return the names of the columns that `_str_plot` fills."""
    return f"time,{','.join(plot_columns(val, f, field_filter or _all_fields))}"


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
    values = plot_values(val, offset, field_filter or _all_fields)
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
        value_transform_fn: Function that returns what to show for a message.

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
