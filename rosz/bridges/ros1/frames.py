"""TCPROS as bytes: frames with a length before them, and connection headers (ROS wiki, TCPROS).

Numbers are little-endian. A header is a frame of fields, each a length and ``name=value``. Nothing
is allocated for a length before that many bytes have arrived.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from struct import Struct

from rosz.errors import DecodeError

__all__ = ("MAX_FRAME", "MAX_HEADER", "FrameReader", "decode_header", "encode_header", "frame")

MAX_HEADER = 4 << 20
"""Largest size of a header in bytes; it holds the text of the definition of a message."""

MAX_FRAME = 1 << 30
"""Largest size of a message in bytes; roscpp refuses larger ones, too."""

_HEADER = "TCPROS header"
_FRAME = "TCPROS frame"
_LENGTH = Struct("<I")
_PIECE = 1 << 16
_MAX_FIELDS = 1000


def frame(data: bytes) -> bytes:
    """Return bytes with their length before them."""
    return _LENGTH.pack(len(data)) + data


def encode_header(fields: Mapping[str, str]) -> bytes:
    """Return a header as a frame."""
    return frame(b"".join(frame(f"{name}={value}".encode()) for name, value in fields.items()))


def decode_header(data: bytes | memoryview) -> dict[str, str]:
    """Return the fields of a header.

    Text that is not UTF-8 is decoded with replacement characters, because definitions of messages
    may have comments in other encodings.

    Args:
        data: The header without the length before it.

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
    """Cuts a stream into frames.

    Received bytes go into `space`; `take` then yields the complete frames among them. The storage
    grows as bytes arrive, at most to twice their number.

    Args:
        limit: Largest frame in bytes.

    Attributes:
        limit: Largest frame in bytes; may be changed between frames.
    """

    def __init__(self, limit: int = MAX_HEADER) -> None:
        self.limit = limit
        self._storage = bytearray()
        self._begin = 0
        self._end = 0

    def space(self) -> memoryview:
        """Return where the next bytes of the stream belong; never empty."""
        if self._end == len(self._storage):
            self._make_space()
        return memoryview(self._storage)[self._end :]

    def take(self, count: int) -> Iterator[memoryview]:
        """Yield the frames that are complete with more bytes of the stream.

        A frame is only valid until the next one is asked for.

        Args:
            count: Number of bytes that were put into `space`.

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
        """Number of bytes that have been received of the next frame, its length included."""
        return self._end - self._begin

    @property
    def size(self) -> int:
        """Number of bytes that its storage takes."""
        return len(self._storage)

    def _make_space(self) -> None:
        """Move what is left to the beginning of a storage with space."""
        left = self._end - self._begin
        size = len(self._storage) if left <= len(self._storage) // 2 else 2 * left
        storage = bytearray(max(size, _PIECE))
        storage[:left] = memoryview(self._storage)[self._begin : self._end]
        self._storage, self._begin, self._end = storage, 0, left
