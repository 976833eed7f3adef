"""Unpacking what bags hold compressed, within a limit: few bytes must not become gigabytes.

The size that a bag declares is checked first. No more than that is unpacked, whatever comes.
"""

from __future__ import annotations

import bz2
from collections.abc import Callable, Iterator
from heapq import heappop, heappush
from typing import Any, BinaryIO

from rosz.bags.bag import Payload, compression_library
from rosz.environment import bag_limit
from rosz.errors import RoszError

_PIECE = 4096
"""Bytes that are unpacked at once where a part is damaged; what comes before it is kept."""
_FILE_PIECE = 1 << 20
_RATIO = 10
"""Times what they have in the file that chunks may take in memory at least."""
_MESSAGE_BYTES = 200
"""Bytes of memory that a message takes beside its payload."""
_BYTES_OF_MESSAGE = 1000
"""Bytes of the limit for each message that a file may have beside one for each of its bytes."""
_FILE_RATIO = 100
"""Times its size that a compressed file may have at least; recorded data rarely reach it."""


class ChunkError(RoszError):
    """Compressed data that cannot be unpacked; readers add the place in the file.

    Attributes:
        sound: What was unpacked before the fault.
    """

    def __init__(self, reason: str, sound: bytes = b"") -> None:
        super().__init__(reason)
        self.sound = sound


def _check(what: str, size: int, limit: int) -> None:
    if size > limit:
        raise ChunkError(
            f"{what} unpacks to {size} bytes or more; the limit is {limit} (ROSZ_BAG_LIMIT)"
        )


class HeldChunks:
    """The memory of chunks that overlap in time, whose messages wait for each other.

    It may be some times what they have in the file, and twice the limit beside that. All chunks
    together may have a message for each byte of the file, and some beside that: recorded messages
    take more.

    Args:
        file_size: Bytes of the file.
        reverse: Whether the chunks come in the order of their ends, the latest first.
    """

    def __init__(self, file_size: int, *, reverse: bool = False) -> None:
        self._reverse = reverse
        self._held: list[tuple[int, int]] = []  # heap: until when, bytes beyond what is allowed
        self._until = self._beyond = 0
        self._messages = file_size + bag_limit() // _BYTES_OF_MESSAGE

    def room(self, start: int, end: int, packed: int, size: int) -> int:
        """Return how many messages a further chunk may have.

        Args:
            start: Stamp of its earliest message, or the chunk's place if chunks are not held.
            end: Stamp of its latest message, or the same.
            packed: Its bytes in the file.
            size: Its bytes in memory.

        Raises:
            ChunkError: It finds no room.
        """
        since, self._until = (-end, -start) if self._reverse else (start, end)
        while self._held and self._held[0][0] < since:
            self._beyond -= heappop(self._held)[1]
        room = 2 * bag_limit() - self._beyond - (size - _RATIO * packed)
        if room < 0:
            raise ChunkError(
                "chunks that overlap in time unpack to more than the limit of"
                f" {bag_limit()} bytes (ROSZ_BAG_LIMIT)"
            )
        self._hold(size - _RATIO * packed)
        return max(min(room // _MESSAGE_BYTES, self._messages), 0)

    def take(self, messages: int) -> None:
        """Count the messages of the last chunk."""
        self._messages -= messages
        self._hold(messages * _MESSAGE_BYTES)

    def _hold(self, size: int) -> None:
        self._beyond += size
        heappush(self._held, (self._until, size))


def too_many(messages: int) -> ChunkError:
    """Return the error of a chunk with more messages than it may have."""
    return ChunkError(
        f"a chunk has more than {messages} messages, too many for the size of the file; the limit"
        f" is {bag_limit()} bytes (ROSZ_BAG_LIMIT)"
    )


def unpack(name: str, data: Payload, size: int) -> bytes:
    """Return the bytes of a chunk.

    Args:
        name: The compression: ``bz2``, ``lz4`` or ``zstd``.
        data: The compressed bytes.
        size: Number of bytes that have to come out.

    Raises:
        ChunkError: They cannot be unpacked, are more than the limit, or others than ``size``.
    """
    _check("a chunk", size, bag_limit())
    begin, failures = _unpacker(name)
    problem = ""
    try:
        plain = begin()(data, size + 1)
    except failures as error:
        problem = f": {error}"
        plain = b"".join(_sound_pieces(begin(), failures, data, size))
    if len(plain) != size or problem:
        amount = f"more than the {size}" if len(plain) > size else f"{len(plain)} of {size}"
        reason = f"{amount} bytes of a chunk can be unpacked{problem}"
        raise ChunkError(reason, plain[:size])
    return plain


def _sound_pieces(
    step: Callable[[Payload, int], bytes],
    failures: tuple[type[Exception], ...],
    data: Payload,
    size: int,
) -> Iterator[bytes]:
    """Yield what is unpacked before the damage."""
    view = memoryview(data)
    for start in range(0, len(view), _PIECE):
        try:
            piece = step(view[start : start + _PIECE], size)
        except failures:
            return
        yield piece
        size -= len(piece)
        if size <= 0:
            return


def _unpacker(
    name: str,
) -> tuple[Callable[[], Callable[[Payload, int], bytes]], tuple[type[Exception], ...]]:
    """Return a function that begins to unpack, and the errors that this raises.

    What it returns takes the next compressed bytes, and the most bytes to return.
    """
    if name == "bz2":
        return lambda: bz2.BZ2Decompressor().decompress, (OSError, EOFError, ValueError)
    library = compression_library(name)
    if name == "lz4":
        return lambda: library.LZ4FrameDecompressor().decompress, (RuntimeError, EOFError)

    def whole(data: Payload, most: int) -> bytes:
        plain: bytes = library.ZstdDecompressor().stream_reader(data).read(most)
        return plain

    return lambda: whole, (library.ZstdError,)


def unpack_message(data: Payload) -> bytes:
    """Return the bytes of a message that was compressed by zstd alone.

    Raises:
        ChunkError: They cannot be unpacked, or are more than the limit.
    """
    library, limit = compression_library("zstd"), bag_limit()
    try:
        size = library.frame_content_size(data)  # negative if it is not declared
        _check("it", size, limit)
        unpacker = library.ZstdDecompressor()
        plain: bytes = (
            unpacker.decompress(data) if size >= 0 else unpacker.stream_reader(data).read(limit + 1)
        )
    except library.ZstdError as error:
        raise ChunkError(f"it cannot be unpacked: {error}") from error
    _check("it", len(plain), limit)
    return plain


def unpack_file(source: BinaryIO, size: int, target: BinaryIO) -> None:
    """Write what a file of some bytes that was compressed by zstd unpacks to.

    Raises:
        ChunkError: It cannot be unpacked as a whole, or to much more than its own size.
    """
    library: Any = compression_library("zstd")
    limit, total = max(bag_limit(), _FILE_RATIO * size), 0
    reader = library.ZstdDecompressor().stream_reader(source, read_across_frames=True)
    try:
        while piece := reader.read(_FILE_PIECE):
            total += len(piece)
            _check("it", total, limit)
            target.write(piece)
    except library.ZstdError as error:
        raise ChunkError(str(error)) from error
