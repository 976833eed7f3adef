"""TCPROS as bytes: frames come out of any pieces, and damage is one error."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.bridges.ros1.frames import (
    FrameReader,
    decode_header,
    encode_header,
    frame,
)
from rosz.errors import DecodeError


def _read(reader: FrameReader, data: bytes, step: int) -> list[bytes]:
    found = []
    while data:
        space = reader.space()
        count = min(len(space), step, len(data))
        space[:count] = data[:count]
        data = data[count:]
        found += [bytes(each) for each in reader.take(count)]
    return found


@given(st.lists(st.binary(max_size=300), max_size=30), st.integers(1, 400))
def test_frames_come_out_of_any_pieces(frames: list[bytes], step: int) -> None:
    reader = FrameReader()
    assert _read(reader, b"".join(map(frame, frames)), step) == frames
    assert reader.pending == 0


def test_frames_larger_than_the_storage_come_out_whole() -> None:
    frames = [bytes([number]) * size for number, size in enumerate((1, 1 << 20, 3, 1 << 17, 0))]
    assert _read(FrameReader(), b"".join(map(frame, frames)), 50_000) == frames


def test_a_length_allocates_nothing() -> None:
    reader = FrameReader(limit=1 << 30)
    assert _read(reader, struct.pack("<I", 1 << 30) + b"begin", 100) == []
    assert len(reader.space()) < 1 << 17


@pytest.mark.parametrize("size", [0xFFFFFFFF, (4 << 20) + 1])
def test_lengths_beyond_the_limit_are_refused(size: int) -> None:
    with pytest.raises(DecodeError, match=f"a length of {size} bytes, expected 4194304 at most"):
        _read(FrameReader(), struct.pack("<I", size), 100)


@given(
    st.dictionaries(
        st.text(st.characters(exclude_characters="=", exclude_categories=["Cs"])),
        st.text(st.characters(exclude_categories=["Cs"])),
    )
)
def test_headers_are_read_as_written(fields: dict[str, str]) -> None:
    assert decode_header(encode_header(fields)[4:]) == fields


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\1\0\0", "3 bytes, expected a length of 4"),
        (b"\xff\xff\xff\xff", "a field of 4294967295 bytes, but 0 are left"),
        (b"\5\0\0\0topic", "field 'topic', expected 'name=value'"),
        (frame(b"a=b") * 0 + b"".join(frame(b"%d=" % n) for n in range(1001)), "more than 1000"),
    ],
)
def test_damaged_headers_are_refused(data: bytes, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        decode_header(data)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_header_or_one_error(data: bytes) -> None:
    try:
        decode_header(data)
    except DecodeError:
        return


def test_definitions_in_other_encodings_are_read() -> None:
    assert decode_header(frame(b"message_definition=# 20 \xb0C")) == {
        "message_definition": "# 20 \N{REPLACEMENT CHARACTER}C"
    }
