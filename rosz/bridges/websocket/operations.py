"""Operations of the rosbridge protocol 2.1 as values, from and to JSON.

The protocol is described in rosbridge_suite's ROSBRIDGE_PROTOCOL.md.
"""

from __future__ import annotations

import base64
import hashlib
import io
import math
import time
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import msgspec

from rosz.errors import UsageError

__all__ = (
    "ActionFeedback",
    "ActionResult",
    "Advertise",
    "AdvertiseAction",
    "AdvertiseService",
    "Authenticate",
    "CallService",
    "CancelActionGoal",
    "Compression",
    "Fragment",
    "Fragments",
    "Operation",
    "Publish",
    "SendActionGoal",
    "ServiceResponse",
    "SetLevel",
    "Subscribe",
    "Unadvertise",
    "UnadvertiseAction",
    "UnadvertiseService",
    "Unsubscribe",
    "fragments",
    "png",
    "read_text",
)

Compression: TypeAlias = Literal["none", "png", "cbor", "cbor-raw"]
_FRAGMENT_SECONDS = 600.0
_PART_SIZE = 200
"""Bytes that a part takes beside its text."""
_HEAD = 100
"""Characters of a text that an error shows."""


class Operation(msgspec.Struct, tag_field="op", kw_only=True):
    """An operation that a client requests.

    Attributes:
        id: Identification that answers and status messages repeat; None if there is none.
        fragment_size: Largest number of characters of an answer; None for no limit.
        compression: Encoding of answers.
    """

    id: str | int | None = None
    fragment_size: float | None = None
    compression: Compression | None = None


class Advertise(Operation, tag="advertise"):
    """Publish a topic."""

    topic: str
    type: str
    latch: bool = False
    queue_size: int = 100


class Unadvertise(Operation, tag="unadvertise"):
    """Publish a topic no longer."""

    topic: str


class Publish(Operation, tag="publish"):
    """Publish a message; ``msg`` is the JSON of its fields."""

    topic: str
    msg: msgspec.Raw = msgspec.Raw(b"{}")
    type: str = ""
    latch: bool = False


class Subscribe(Operation, tag="subscribe"):
    """Subscribe to a topic; ``throttle_rate`` is the shortest time between messages in ms."""

    topic: str
    type: str | None = None
    throttle_rate: float = 0
    queue_length: int = 0


class Unsubscribe(Operation, tag="unsubscribe"):
    """End one subscription of a topic, or all without an id."""

    topic: str


class CallService(Operation, tag="call_service"):
    """Call a service; ``timeout`` is in seconds."""

    service: str
    type: str | None = None
    args: dict[str, Any] | list[Any] | None = None
    timeout: float | None = None


class AdvertiseService(Operation, tag="advertise_service"):
    """Serve a service."""

    service: str
    type: str


class UnadvertiseService(Operation, tag="unadvertise_service"):
    """Serve a service no longer."""

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
    """Serve an action."""

    action: str
    type: str


class UnadvertiseAction(Operation, tag="unadvertise_action"):
    """Serve an action no longer."""

    action: str


class ActionFeedback(Operation, tag="action_feedback"):
    """Tell about the execution of the goal that has the id."""

    action: str
    values: dict[str, Any] | list[Any] | None = None


class ActionResult(Operation, tag="action_result"):
    """End the goal that has the id; ``status`` is that of action_msgs/GoalStatus."""

    action: str
    values: dict[str, Any] | list[Any] | str | None = None
    status: int = 4
    result: bool = True


class SetLevel(Operation, tag="set_level"):
    """Choose which status messages are sent."""

    level: Literal["info", "warning", "error", "none"]


class Authenticate(Operation, tag="auth"):
    """Prove to know the password (rosauth): ``mac`` is a SHA-512 of it and of the other fields."""

    mac: str
    client: str = ""
    dest: str = ""
    rand: str = ""
    t: float = 0
    level: str = ""
    end: float = 0

    def expected_mac(self, password: str) -> str:
        """Return what ``mac`` is if the client knows the password."""
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


_Any = (
    Advertise
    | Unadvertise
    | Publish
    | Subscribe
    | Unsubscribe
    | CallService
    | AdvertiseService
    | UnadvertiseService
    | ServiceResponse
    | SendActionGoal
    | CancelActionGoal
    | AdvertiseAction
    | UnadvertiseAction
    | ActionFeedback
    | ActionResult
    | SetLevel
    | Authenticate
    | Fragment
)
_decoder = msgspec.json.Decoder(_Any)


def read_text(text: str | bytes) -> Operation:
    """Return the operation in a JSON text.

    Raises:
        UsageError: The text is not a JSON object, or not an operation.
    """
    try:
        operation: Operation = _decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        head = text[:_HEAD].decode(errors="replace") if isinstance(text, bytes) else text[:_HEAD]
        raise UsageError(f"{error}, in {head!r}") from error
    return operation


class Fragments:
    """Operations that a client sends in parts.

    Args:
        limit: Largest number of characters that wait for their rest; each part counts as some more.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._size = 0
        self._waiting: dict[str | int, tuple[float, dict[int, str]]] = {}

    def add(self, part: Fragment) -> str | None:
        """Return the text of which a part is the last one; None if others are missing.

        Raises:
            UsageError: The part does not fit, or there are too many that wait.
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
            return "".join(parts[number] for number in range(part.total))
        if self._size > self._limit:
            self._waiting.clear()
            self._size = 0
            raise UsageError(f"fragment: more than {self._limit} characters wait for their rest")
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
    """Yield a JSON text whole, or its parts as operations if it is longer than a size.

    Args:
        text: The text.
        size: Number of characters; None for no limit.
        number: Number of the text, which the id of the parts is made of.
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
    """Return a JSON text in the pixels of a PNG, as the operation ``png``.

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
