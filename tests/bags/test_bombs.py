"""Bags that unpack to gigabytes: an error that names the part, in bounded memory."""

from __future__ import annotations

import itertools
import sqlite3
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

import rosz.bags
from bags.bombs import CHANNEL, write_bombs
from rosz.bags import Channel, McapReader, McapWriter
from rosz.bags.bag import in_order
from rosz.bags.formats import mcap_records as mcap
from rosz.bags.formats.chunks import HeldChunks
from rosz.bags.formats.mcap_records import Op
from rosz.bags.formats.rosbag2_writer import Rosbag2Writer
from rosz.errors import BagError, UsageError

SIZE = 768 << 20
MOST = 600 << 20
_USE = """
import re, sys
from pathlib import Path
from rosz.cli.main import run
from rosz.ros1.tools import rosbag

bag = sys.argv[1]
for line in (["info", bag], ["check", bag], ["convert", bag, sys.argv[2]]):
    print("exit code", run(["bag", *line]), flush=True)
try:
    with rosbag.Bag(bag, allow_unindexed=True) as opened:
        print(len(list(opened.read_messages(raw=True))), "messages")
except rosbag.ROSBagException as error:
    print(error)
# Not ru_maxrss, which begins with the memory of the process that started this one.
print(int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) << 10)
"""


def test_small_bags_do_not_unpack_to_gigabytes(tmp_path: Path) -> None:
    for bag in write_bombs(tmp_path, SIZE):
        used = subprocess.run(
            [sys.executable, "-c", _USE, str(bag), f"{bag}-copy.mcap"],
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        assert int(used.stdout.split()[-1]) < MOST, bag
        assert "exit code 1" in used.stdout
        assert bag.name in used.stderr
        assert "ROSZ_BAG_LIMIT" in used.stderr or "more than the 1000 bytes" in used.stderr, bag


def write_overlapping(path: Path, messages: int, size: int, chunks: int) -> None:
    """Write chunks of one stamp, with so many messages of some bytes in each."""
    body = mcap.record(Op.SCHEMA, mcap.schema_body(1, CHANNEL))
    body += mcap.record(Op.CHANNEL, mcap.channel_body(1, 1, CHANNEL))
    body += (mcap.MESSAGE.pack(Op.MESSAGE, 22 + size, 1, 1, 5, 5) + bytes(size)) * messages
    data = zstandard.ZstdCompressor(level=1).compress(body)
    chunk = mcap.CHUNK_HEAD.pack(5, 5, len(body), 0) + mcap.text("zstd")
    chunk += struct.pack("<Q", len(data)) + data
    header = mcap.record(Op.HEADER, mcap.text("ros2") + mcap.text(""))
    path.write_bytes(mcap.MAGIC + header + mcap.record(Op.CHUNK, chunk) * chunks)


@pytest.mark.parametrize("reverse", [False, True])
def test_chunks_that_wait_for_each_other_are_bounded(tmp_path: Path, reverse: bool) -> None:
    write_overlapping(tmp_path / "a.mcap", 1, 100 << 20, 6)
    problems: list[BagError] = []
    with McapReader(tmp_path / "a.mcap") as reader:
        taken = len(list(reader.messages(reverse=reverse, damaged=problems.append)))
    assert taken == 2
    assert len(problems) == 4
    assert "overlap in time" in problems[0].reason


def test_messages_of_a_small_chunk_are_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROSZ_BAG_LIMIT", "2000000")
    write_overlapping(tmp_path / "a.mcap", 50_000, 0, 1)
    with McapReader(tmp_path / "a.mcap") as reader:
        assert not reader.count()
        assert "messages" in reader.problems[0].reason


def test_messages_of_many_small_chunks_are_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of them would be allowed if it were alone."""
    monkeypatch.setenv("ROSZ_BAG_LIMIT", "1000000")
    write_overlapping(tmp_path / "a.mcap", 1000, 0, 20)
    with McapReader(tmp_path / "a.mcap") as reader:
        assert 1000 <= reader.count() <= 1000 + reader.size < 10_000
        assert "too many for the size of the file" in reader.problems[0].reason


def test_messages_of_chunks_that_do_not_overlap_are_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROSZ_BAG_LIMIT", "1000000")
    chunks = HeldChunks(7)
    assert chunks.room(1, 2, 10, 100) == 1007
    chunks.take(1000)
    assert chunks.room(3, 4, 10, 100) == 7
    chunks.take(8)
    assert chunks.room(5, 6, 10, 100) == 0


def test_many_chunks_of_one_time_are_held_at_once() -> None:
    chunks, begin = HeldChunks(1 << 30), time.process_time()
    for _ in range(20_000):
        assert chunks.room(5, 5, 10, 100)
        chunks.take(1)
    assert time.process_time() - begin < 4


@pytest.mark.parametrize(
    ("table", "row"),
    [
        (
            "CREATE VIEW Messages AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x FROM c)"
            " SELECT x AS id, 1 AS topic_id, x AS timestamp, x'00' AS data FROM c",
            "SELECT 1",
        ),
        (
            "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER,"
            " data BLOB AS (zeroblob(900000000)))",
            "INSERT INTO messages VALUES (1, 1, 5)",
        ),
        ("CREATE VIRTUAL TABLE messages USING fts5(id, topic_id, timestamp, data)", "SELECT 1"),
    ],
)
def test_tables_that_are_computed_are_refused(tmp_path: Path, table: str, row: str) -> None:
    with Rosbag2Writer(tmp_path / "x", storage="sqlite3") as writer:
        writer.write(writer.add(CHANNEL), 5, b"hello")
    with sqlite3.connect(tmp_path / "x" / "x_0.db3") as database:
        for statement in ("DROP TABLE messages", table, row):
            database.execute(statement)
    database.close()
    with pytest.raises(BagError, match="is computed, perhaps without end"):
        rosz.bags.open_reader(tmp_path / "x")


def test_the_limit_can_be_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    channel = Channel("/chatter", "std_msgs/msg/String", definition="string data\n")
    with McapWriter(tmp_path / "a.mcap", compression="zstd") as writer:
        writer.write(writer.add(channel), 5, bytes(5000))
    monkeypatch.setenv("ROSZ_BAG_LIMIT", "5000")
    with (
        rosz.bags.open_reader(tmp_path / "a.mcap") as reader,
        pytest.raises(BagError, match=r"at byte 33: a chunk unpacks to 51\d\d .* limit is 5000"),
    ):
        list(reader.messages())
    monkeypatch.setenv("ROSZ_BAG_LIMIT", "6000")
    with rosz.bags.open_reader(tmp_path / "a.mcap") as reader:
        assert len(list(reader.messages())) == 1
    monkeypatch.setenv("ROSZ_BAG_LIMIT", "much")
    with rosz.bags.open_reader(tmp_path / "a.mcap") as reader, pytest.raises(UsageError):
        list(reader.messages())


def test_many_chunks_of_one_time_are_merged_at_once() -> None:
    begin = time.process_time()
    spans = [(5, 9, number) for number in range(40_000)]
    rows = [run for run in in_order(spans, lambda number: [(5, number)], reverse=False) if run]
    assert time.process_time() - begin < 4
    assert rows == [[(5, number) for number in range(40_000)]]


@settings(max_examples=300)
@given(st.lists(st.lists(st.integers(0, 30), min_size=1, max_size=9), max_size=8), st.booleans())
def test_rows_of_spans_that_overlap_are_in_order(stamps: list[list[int]], reverse: bool) -> None:
    spans, place = [], itertools.count()
    for span in stamps:
        rows = [(stamp, next(place)) for stamp in span]
        spans.append((min(span), max(span), rows))
    merged = [row for run in in_order(spans, list, reverse=reverse) for row in run]
    assert merged == sorted((row for *_, rows in spans for row in rows), reverse=reverse)
