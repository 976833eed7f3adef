"""What arrives: thin views on Zenoh's samples, queries and replies, read only when asked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Self

import zenoh

from rosz.errors import TransportError
from rosz.session.calls import ENDING, keep
from rosz.session.ending import ClosedSession
from rosz.session.stamp import Stamp

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ("Query", "Reply", "Sample", "stamp_of", "to_timestamp")

_SECOND = 1_000_000_000
_ANSWERED: Final = ClosedSession("the question is closed")


def stamp_of(timestamp: zenoh.Timestamp | None) -> Stamp | None:
    """Return a Zenoh timestamp as a stamp."""
    if timestamp is None:
        return None
    raw = int(str(timestamp.get_time_as_ntp64()))
    seconds, fraction = raw >> 32, raw & 0xFFFFFFFF
    nanoseconds = (fraction * _SECOND + (1 << 31)) >> 32
    return Stamp(seconds * _SECOND + nanoseconds, str(timestamp.get_id()))


def to_timestamp(stamp: Stamp) -> zenoh.Timestamp:
    """Return a stamp as a Zenoh timestamp."""
    seconds, nanoseconds = divmod(stamp.time, _SECOND)
    digits = stamp.id if len(stamp.id) % 2 == 0 else "0" + stamp.id
    # Zenoh prints an id as one number, and takes it as little-endian bytes.
    return zenoh.Timestamp(zenoh.NTP64(seconds, nanoseconds), bytes.fromhex(digits)[::-1])


def _check_end() -> None:
    if ENDING.is_set():
        raise TransportError("cannot answer: the program ends")


class Sample:
    """One put or delete that arrived."""

    __slots__ = ("_raw",)

    def __init__(self, raw: zenoh.Sample) -> None:
        self._raw = raw

    @property
    def key(self) -> str:
        """Key it was written to."""
        return str(self._raw.key_expr)

    @property
    def payload(self) -> bytes:
        """What was written."""
        return self._raw.payload.to_bytes()

    @property
    def size(self) -> int:
        """Bytes of the payload, without copying it."""
        return len(self._raw.payload)

    @property
    def attachment(self) -> bytes | None:
        """What came beside the payload."""
        raw = self._raw.attachment
        return None if raw is None else raw.to_bytes()

    @property
    def stamp(self) -> Stamp | None:
        """When it was written, by the network's clock."""
        return stamp_of(self._raw.timestamp)

    @property
    def deleted(self) -> bool:
        """Whether it is a delete."""
        return self._raw.kind == zenoh.SampleKind.DELETE


class Query:
    """One question that arrived; close it after the last reply, or the asker waits for more."""

    __slots__ = ("_raw",)

    def __init__(self, raw: zenoh.Query) -> None:
        self._raw: Any = raw

    @property
    def key(self) -> str:
        """Key expression asked for."""
        return str(self._raw.key_expr)

    @property
    def parameters(self) -> str:
        """What follows the ``?`` of the selector."""
        return str(self._raw.parameters)

    @property
    def payload(self) -> bytes | None:
        """What was sent along."""
        raw = self._raw.payload
        return None if raw is None else raw.to_bytes()

    @property
    def attachment(self) -> bytes | None:
        """What came beside the payload."""
        raw = self._raw.attachment
        return None if raw is None else raw.to_bytes()

    def reply(
        self,
        key: str,
        payload: bytes,
        *,
        attachment: bytes | None = None,
        stamp: Stamp | None = None,
    ) -> None:
        """Send one answer.

        Raises:
            TransportError: The session is closed, or the program is about to end.
        """
        _check_end()
        try:
            self._raw.reply(
                key,
                payload,
                attachment=attachment,
                timestamp=None if stamp is None else to_timestamp(stamp),
            )
        except zenoh.ZError as error:
            raise TransportError(f"cannot answer on '{key}': {error}") from error

    def reply_error(self, text: str) -> None:
        """Send an error as the answer.

        Raises:
            TransportError: The session is closed, or the program is about to end.
        """
        _check_end()
        try:
            self._raw.reply_err(text.encode())
        except zenoh.ZError as error:
            raise TransportError(f"cannot answer: {error}") from error

    def close(self) -> None:
        """Tell the asker that no more answers come; again is no error."""
        raw, self._raw = self._raw, _ANSWERED
        if raw is _ANSWERED:
            return
        if ENDING.is_set():
            keep(raw)
        else:
            raw.drop()
        del raw

    def __del__(self) -> None:
        """Close what nobody closed."""
        self.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


class Reply:
    """One answer that arrived; when not ``ok`` the payload is the text of the error."""

    __slots__ = ("_raw", "_sample", "ok")

    def __init__(self, raw: zenoh.Reply) -> None:
        self._raw = raw
        self._sample = sample = raw.ok  # anew with every look
        self.ok = sample is not None

    @property
    def key(self) -> str:
        """Key that the answer is for; empty for an error."""
        return "" if self._sample is None else str(self._sample.key_expr)

    @property
    def payload(self) -> bytes:
        """The answer, or the text of the error."""
        result = self._sample or self._raw.result
        return result.payload.to_bytes()

    @property
    def attachment(self) -> bytes | None:
        """What came beside the payload."""
        raw = None if self._sample is None else self._sample.attachment
        return None if raw is None else raw.to_bytes()

    @property
    def stamp(self) -> Stamp | None:
        """When the value was written, by the network's clock."""
        return None if self._sample is None else stamp_of(self._sample.timestamp)

    @property
    def deleted(self) -> bool:
        """Whether the answer is that the key was deleted."""
        return self._sample is not None and self._sample.kind == zenoh.SampleKind.DELETE
