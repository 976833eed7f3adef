"""The bytes of TCPROS: frames that begin with a length, and connection headers (ROS wiki, TCPROS).

Numbers are little-endian. A header is a frame of fields; each field is a length and ``name=value``.
Memory grows only with the bytes that have arrived, whatever length a frame announces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from struct import Struct

from rosz.errors import DecodeError

MAX_HEADER = 4 << 20
"""Largest size of a header in bytes; a header includes the text of a message definition."""

MAX_FRAME = 1 << 30
"""Largest size of a message in bytes, as in roscpp."""

_HEADER = "TCPROS header"
_FRAME = "TCPROS frame"
_LENGTH = Struct("<I")
_PIECE = 1 << 16
_MAX_FIELDS = 1000


def frame(data: bytes) -> bytes:
    """Return a frame: the length of some bytes, then the bytes."""
    return _LENGTH.pack(len(data)) + data


def encode_header(fields: Mapping[str, str]) -> bytes:
    """Return a header as a frame."""
    return frame(b"".join(frame(f"{name}={value}".encode()) for name, value in fields.items()))


def decode_header(data: bytes | memoryview) -> dict[str, str]:
    """Return the fields of a header.

    Text that is not UTF-8 is decoded with replacement characters, because definitions of messages
    may have comments in other encodings.

    Args:
        data: The header without the length of its frame.

    Raises:
        DecodeError: The bytes are not a header.
    """
    fields: dict[str, str] = {}
    position, end = 0, len(data)
    while position < end:
        if end - position < _LENGTH.size:
            raise DecodeError(_HEADER, position, f"{end - position} bytes, expected a length of 4")
        (size,) = _LENGTH.unpack_from(data, position)
        position += _LENGTH.size
        if size > end - position:
            raise DecodeError(
                _HEADER, position, f"a field of {size} bytes, but {end - position} are left"
            )
        text = bytes(data[position : position + size]).decode(errors="replace")
        name, separator, value = text.partition("=")
        if not separator:
            raise DecodeError(_HEADER, position, f"field '{text:.40}', expected 'name=value'")
        if len(fields) >= _MAX_FIELDS:
            raise DecodeError(_HEADER, position, f"more than {_MAX_FIELDS} fields")
        fields[name] = value
        position += size
    return fields


class FrameReader:
    """Splits a stream into frames.

    The caller writes received bytes to `space`; `take` then yields the complete frames. The storage
    grows as bytes arrive, at most to twice their number.

    Attributes:
        limit: Largest size of a frame in bytes; may be changed between frames.
    """

    def __init__(self, limit: int = MAX_HEADER) -> None:
        self.limit = limit
        self._storage = bytearray()
        self._begin = 0
        self._end = 0

    def space(self) -> memoryview:
        """Return the memory for the next bytes of the stream; it is never empty."""
        if self._end == len(self._storage):
            self._make_space()
        return memoryview(self._storage)[self._end :]

    def take(self, count: int) -> Iterator[memoryview]:
        """Add bytes of the stream, and yield the frames that are now complete.

        Each frame is valid only until the next one is requested.

        Args:
            count: Number of bytes that were written to `space`.

        Raises:
            DecodeError: A frame is larger than the limit.
        """
        self._end += count
        while self._end - self._begin >= _LENGTH.size:
            (size,) = _LENGTH.unpack_from(self._storage, self._begin)
            if size > self.limit:
                raise DecodeError(
                    _FRAME, -1, f"a length of {size} bytes, expected {self.limit} at most"
                )
            if self._end - self._begin < _LENGTH.size + size:
                return
            begin = self._begin + _LENGTH.size
            self._begin = begin + size
            yield memoryview(self._storage)[begin : begin + size]
        if self._begin == self._end:
            self._begin = self._end = 0

    @property
    def pending(self) -> int:
        """Number of bytes of the next frame that have arrived, including its length."""
        return self._end - self._begin

    @property
    def size(self) -> int:
        """Size of the storage in bytes."""
        return len(self._storage)

    def _make_space(self) -> None:
        """Move the remaining bytes to the beginning of a new storage that has space."""
        left = self._end - self._begin
        size = len(self._storage) if left <= len(self._storage) // 2 else 2 * left
        storage = bytearray(max(size, _PIECE))
        storage[:left] = memoryview(self._storage)[self._begin : self._end]
        self._storage, self._begin, self._end = storage, 0, left
