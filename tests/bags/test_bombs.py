"""Bags that unpack to gigabytes: an error that names the part, in bounded memory."""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path

import pytest
import zstandard

import rosz.bags
from bags.bombs import CHANNEL, write_bombs
from rosz.bags import Channel, McapReader, McapWriter
from rosz.bags.formats import mcap_records as mcap
from rosz.bags.formats.mcap_records import Op
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
