"""Operations of the rosbridge protocol 2.1 as classes, decoded from and encoded as JSON.

The protocol is described in rosbridge_suite's ROSBRIDGE_PROTOCOL.md.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import io
import math
import operator
import time
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import msgspec

from rosz.errors import UsageError

Compression: TypeAlias = Literal["none", "png", "cbor", "cbor-raw"]
# The time is the fragment_timeout of rosbridge_suite.
_FRAGMENT_SECONDS = 600.0
_PART_SIZE = 200
"""Bytes of memory that a part needs in addition to its text."""
_HEAD = 100
"""Number of characters of a text that an error shows."""


class Operation(msgspec.Struct, tag_field="op", kw_only=True):
    """An operation that a client requests.

    Attributes:
        id: Identification, repeated in answers and status messages; None if not given.
        fragment_size: Largest number of characters of an answer; None for no limit.
        compression: Encoding of answers.
    """

    id: str | int | None = None
    fragment_size: float | None = None
    compression: Compression | None = None


class Advertise(Operation, tag="advertise"):
    """Start to publish a topic."""

    topic: str
    type: str
    latch: bool = False
    queue_size: int = 100


class Unadvertise(Operation, tag="unadvertise"):
    """Stop publishing a topic."""

    topic: str


class Publish(Operation, tag="publish"):
    """Publish a message; ``msg`` is the JSON of its fields."""

    topic: str
    msg: msgspec.Raw = msgspec.Raw(b"{}")
    type: str = ""
    latch: bool = False


class Subscribe(Operation, tag="subscribe"):
    """Subscribe to a topic; ``throttle_rate`` is the least time between messages, in ms."""

    topic: str
    type: str | None = None
    throttle_rate: float = 0
    queue_length: int = 0


class Unsubscribe(Operation, tag="unsubscribe"):
    """End the subscription that has the id, or all subscriptions of a topic without an id."""

    topic: str


class CallServiceOperation(Operation, tag="call_service"):
    """Call a service; ``timeout`` is in seconds."""

    service: str
    type: str | None = None
    args: dict[str, Any] | list[Any] | None = None
    timeout: float | None = None


class AdvertiseService(Operation, tag="advertise_service"):
    """Start to serve a service."""

    service: str
    type: str


class UnadvertiseService(Operation, tag="unadvertise_service"):
    """Stop serving a service."""

    service: str


class ServiceResponse(Operation, tag="service_response"):
    """Answer a call; ``values`` is the error's text if ``result`` is false."""

    service: str
    values: dict[str, Any] | list[Any] | str | None = None
    result: bool = True


class SendActionGoal(Operation, tag="send_action_goal"):
    """Send a goal."""

    action: str
    action_type: str
    args: dict[str, Any] | list[Any] | None = None
    feedback: bool = False


class CancelActionGoal(Operation, tag="cancel_action_goal"):
    """Cancel the goal that has the id."""

    action: str


class AdvertiseAction(Operation, tag="advertise_action"):
    """Start to serve an action."""

    action: str
    type: str


class UnadvertiseAction(Operation, tag="unadvertise_action"):
    """Stop serving an action."""

    action: str


class ActionFeedback(Operation, tag="action_feedback"):
    """Send feedback of the goal that has the id."""

    action: str
    values: dict[str, Any] | list[Any] | None = None


class ActionResult(Operation, tag="action_result"):
    """End the goal that has the id; ``status`` is a constant of action_msgs/GoalStatus."""

    action: str
    values: dict[str, Any] | list[Any] | str | None = None
    status: int = 4
    result: bool = True


class SetLevel(Operation, tag="set_level"):
    """Choose which status messages are sent."""

    level: Literal["info", "warning", "error", "none"]


class Authenticate(Operation, tag="auth"):
    """Authenticate as in rosauth; ``mac`` is a SHA-512 of the password and the other fields."""

    mac: str
    client: str = ""
    dest: str = ""
    rand: str = ""
    t: float = 0
    level: str = ""
    end: float = 0

    def expected_mac(self, password: str) -> str:
        """Return the ``mac`` of a client that knows the password."""
        parts = (
            password,
            self.client,
            self.dest,
            self.rand,
            int(self.t),
            self.level,
            int(self.end),
        )
        return hashlib.sha512("".join(map(str, parts)).encode()).hexdigest()


class Fragment(Operation, tag="fragment"):
    """A part of the text of an operation."""

    data: str
    num: int
    total: int


# The union of all operations; the decoder selects the class by its tag.
_classes: Any = functools.reduce(operator.or_, Operation.__subclasses__())
_decoder: msgspec.json.Decoder[Operation] = msgspec.json.Decoder(_classes)


def read_text(text: str | bytes) -> Operation:
    """Return the operation in a JSON text.

    Raises:
        UsageError: The text is not JSON, or not an operation.
    """
    try:
        return _decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        head = text[:_HEAD].decode(errors="replace") if isinstance(text, bytes) else text[:_HEAD]
        raise UsageError(f"{error}, in {head!r}") from error


class Fragments:
    """Operations that a client sends in parts.

    Args:
        limit: Largest total size of incomplete operations, in characters; each part counts as its
            text and a constant.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._size = 0
        self._waiting: dict[str | int, tuple[float, dict[int, str]]] = {}

    def add(self, part: Fragment) -> str | None:
        """Add a part; return the whole text if this part completes it, otherwise None.

        Raises:
            UsageError: The numbers of the part are wrong, or too many parts wait.
        """
        if part.id is None or not 0 <= part.num < part.total:
            raise UsageError(
                f"fragment: expected an id and num below total, got num {part.num} of {part.total}"
            )
        self._expire(time.monotonic() - _FRAGMENT_SECONDS)
        _, parts = self._waiting.setdefault(part.id, (time.monotonic(), {}))
        self._size += len(part.data) - len(parts.get(part.num, ""))
        self._size += 0 if part.num in parts else _PART_SIZE
        parts[part.num] = part.data
        if len(parts) == part.total:
            self._forget(part.id)
            if max(parts) >= part.total:
                raise UsageError(f"fragment: the parts of {part.id!r} differ in their total")
            return "".join(parts[number] for number in range(part.total))
        if self._size > self._limit:
            self._waiting.clear()
            self._size = 0
            raise UsageError(f"fragment: more than {self._limit} characters wait for missing parts")
        return None

    def _expire(self, oldest: float) -> None:
        while self._waiting:
            first = next(iter(self._waiting))
            if self._waiting[first][0] > oldest:
                return
            self._forget(first)

    def _forget(self, key: str | int) -> None:
        _, parts = self._waiting.pop(key)
        self._size -= sum(len(data) + _PART_SIZE for data in parts.values())


def fragments(text: bytes, size: float | None, number: int) -> Iterator[bytes]:
    """Yield a JSON text, or operations with its parts if the text is too long.

    Args:
        text: The text.
        size: Largest number of characters of a part; None for no limit.
        number: Number of the text, which becomes the id of the parts.
    """
    if not size or not math.isfinite(size) or len(text) <= size:
        yield text
        return
    step = max(1, int(size))
    characters = text.decode()
    total = math.ceil(len(characters) / step)
    for num in range(total):
        part = characters[num * step : (num + 1) * step]
        fragment = {"op": "fragment", "id": str(number), "data": part, "num": num, "total": total}
        yield msgspec.json.encode(fragment)


def png(text: bytes) -> bytes:
    """Return the operation ``png``, whose picture has the bytes of a JSON text as pixels.

    Raises:
        ImportError: Pillow is not installed.
    """
    from PIL import Image

    width = max(1, math.isqrt(len(text) // 3))
    height = max(1, math.ceil(len(text) / 3 / width))
    pixels = text.ljust(width * height * 3, b"\n")
    file = io.BytesIO()
    Image.frombytes("RGB", (width, height), pixels).save(file, "png")
    return msgspec.json.encode({"op": "png", "data": base64.b64encode(file.getvalue()).decode()})
