"""One topic while a page shows it: its newest message, and what flows."""

from __future__ import annotations

import operator
import re
import time
from collections.abc import Callable
from typing import Any

import msgspec

from rosz import introspect
from rosz.errors import DecodeError, UsageError
from rosz.message import Message
from rosz.node import Node
from rosz.time import DurationValue, TimeValue
from rosz.web.model.traffic import Flow, flow_of

_QUEUE = 3
_MOST_ELEMENTS = 30
_LONGEST_TEXT = 200
_FEW_BYTES = 16
_OPERATORS: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
    "contains": operator.contains,
}
_COMPARISON = re.compile(r"([\w/.\[\]:]+)\s*(==|!=|<=|>=|<|>|\bcontains\b)\s*(.+)")
_TRUTHS = {"true": 1.0, "false": 0.0}


class FieldCondition:
    """A comparison of a field with a value, such as ``pose/x > 3`` or ``data contains go``.

    It is not Python, as that of ``rostopic`` is, since those who see a page may not run programs.

    Args:
        text: The comparison.

    Raises:
        UsageError: It is not one.
    """

    def __init__(self, text: str) -> None:
        match = _COMPARISON.fullmatch(text.strip())
        if match is None:
            raise UsageError(
                f"'{text}' is not a condition; expected a field, one of {', '.join(_OPERATORS)},"
                " and a value, such as linear/x > 0.5"
            )
        path, self._operator, value = match.groups()
        self._path = introspect.FieldPath(path.replace(".", "/"))
        self._value = value.strip("'\"")
        try:
            self._number: float | None = float(self._value)
        except ValueError:
            self._number = _TRUTHS.get(self._value.lower())

    def accepts(self, message: Any) -> bool:
        """Return whether a message fulfils it; one without the field does not."""
        try:
            value = self._path.read(message)
        except (LookupError, AttributeError):
            return False
        if isinstance(value, TimeValue | DurationValue):
            value = value.to_sec()
        compare = _OPERATORS[self._operator]
        if self._operator != "contains" and isinstance(value, int | float):
            return self._number is not None and compare(value, self._number)
        return compare(str(value), self._value)


class TopicWatch:
    """Keeps the newest message of a topic, as bytes until somebody looks.

    Args:
        node: The node that subscribes to it.
        survey: The running nodes.
        topic: Full name of the topic.
        condition: What messages have to fulfil to be kept; all are counted.

    Attributes:
        type_name: Its type, ``pkg/msg/Name``.
        received: Number of messages that have come.

    Raises:
        NotFoundError: The topic does not exist.
        TypeNotFound: Its type is not known here.
        DefinitionError: Its definition differs from the one here.
    """

    def __init__(
        self,
        node: Node,
        survey: introspect.Survey,
        topic: str,
        condition: FieldCondition | None = None,
    ) -> None:
        types = introspect.topic_types(survey.view).get(topic, ("",))
        token = introspect.find_token(survey.view, topic, types[0])
        self.topic: str = topic
        self.type_name: str = token.type_name
        self.received: int = 0
        self._condition = condition
        self._now = node.now
        self._payload: bytes | None = None
        self._message: tuple[bytes, Any] | None = None
        self._sizes = introspect.BandwidthMeter()
        self._ages = introspect.DelayMeter(window=100)
        self._delay: introspect.DelayStats | None = None
        cls = introspect.find_class(node, token)
        self._stamped: bool = cls._has_header
        self._decode = node.context.decoder(cls)
        self._subscription = node.subscription(
            topic, cls, self._receive, queue_size=_QUEUE, raw=True
        )

    def _receive(self, payload: bytes) -> None:
        self.received += 1
        self._sizes.add(len(payload), time.monotonic_ns())
        if self._stamped:
            self._ages.add(introspect.read_stamp(payload, self.type_name), self._now())
        if self._condition is None or self._fulfils(self._condition, payload):
            self._payload = payload

    def _fulfils(self, condition: FieldCondition, payload: bytes) -> bool:
        try:
            return condition.accepts(self._decode(payload))
        except DecodeError:  # which `message` reports of all messages
            return True

    def message(self) -> Any:
        """Return the newest message; None before the first one.

        Raises:
            DecodeError: The bytes are not of its type.
        """
        payload = self._payload
        if payload is None:
            return None
        decoded = self._message
        if decoded is None or decoded[0] is not payload:
            decoded = self._message = payload, self._decode(payload)
        return decoded[1]

    def flow(self) -> Flow | None:
        """Return rate and bandwidth; None before the second message."""
        return flow_of(self._sizes.stats(time.monotonic_ns()))

    def delay(self) -> introspect.DelayStats | None:
        """Return the age of messages when they arrive; None if they have no header."""
        self._delay = self._ages.stats() or self._delay
        return self._delay

    def close(self) -> None:
        """Unsubscribe."""
        self._subscription.close()


def message_tree(value: Any, name: str, path: str = "") -> dict[str, Any]:
    """Return a message, or a value in it, as a tree of dictionaries for a page.

    Each has ``id``, a path that stays the same, ``name``, ``value`` as text, and ``children``.
    Long sequences are cut, with a note of the number left out.
    """
    here = f"{path}/{name}"
    if isinstance(value, Message) and not isinstance(value, TimeValue | DurationValue):
        children = [message_tree(getattr(value, item), item, here) for item in value.__slots__]
        return {"id": here, "name": name, "value": "", "children": children}
    if isinstance(value, str | bytes | bool | int | float | TimeValue | DurationValue):
        return {"id": here, "name": name, "value": _scalar_text(value)}
    if isinstance(value, msgspec.Struct) or not hasattr(value, "__len__"):
        return {"id": here, "name": name, "value": str(value)}
    first = [
        message_tree(item, f"[{number}]", here)
        for number, item in enumerate(value[:_MOST_ELEMENTS])
    ]
    if len(value) > _MOST_ELEMENTS:
        rest = len(value) - _MOST_ELEMENTS
        first.append({"id": f"{here}/more", "name": "…", "value": f"and {rest} more"})
    return {"id": here, "name": name, "value": f"{len(value)} elements", "children": first}


def _scalar_text(value: Any) -> str:
    if isinstance(value, bytes):
        more = "…" if len(value) > _FEW_BYTES else ""
        return f"{len(value)} bytes: {value[:_FEW_BYTES].hex(' ')}{more}"
    if isinstance(value, str):
        text = value if len(value) <= _LONGEST_TEXT else value[:_LONGEST_TEXT] + "…"
        return f'"{text}"'
    if isinstance(value, TimeValue | DurationValue):
        return f"{value.to_sec():.9f}"
    return repr(value)
