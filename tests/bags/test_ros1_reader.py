"""The reader of ROS 1's bags: order, ranges, compression, and what is damaged."""

from __future__ import annotations

import os
import random
import time
from itertools import pairwise
from pathlib import Path
from unittest.mock import Mock

import pytest
from rosbags.rosbag1 import Reader

from rosz.bags import Channel, create_writer, open_reader
from rosz.bags.formats import ros1_records
from rosz.bags.formats.ros1_reader import Ros1Reader
from rosz.bags.summary import summarize
from rosz.errors import BagError

from .ros1_files import STORE, write_bag

STRING = STORE.types["std_msgs/msg/String"]
POINT = STORE.types["geometry_msgs/msg/Point"]
COUNT = 60
START = 1_000_000_000


def _messages(size: int = 20) -> list[tuple[str, int, object]]:
    found: list[tuple[str, int, object]] = []
    for number in range(COUNT):
        stamp = START + number * 10_000_000
        found.append(("/chatter", stamp, STRING(data=f"{number} " + "x" * size)))
        found.append(("/point", stamp + 1, POINT(x=float(number), y=0.0, z=0.0)))
    return found


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_bag_reads_as_other_libraries_read_it(tmp_path: Path, compression: str) -> None:
    path = write_bag(tmp_path / "x.bag", _messages(), compression=compression, latched=["/point"])
    with Ros1Reader(path) as ours, Reader(path) as theirs:
        expected = [(one.topic, stamp, data) for one, stamp, data in theirs.messages()]
        found = [(one.channel.topic, one.stamp, bytes(one.data)) for one in ours.messages()]
        assert found == expected
        assert ours.indexed
        assert ours.count() == len(expected)
        assert (ours.start, ours.end) == (expected[0][1], expected[-1][1])
        assert {one.compression for one in ours.chunks} == {compression}
        chatter, point = ours.channels
        assert (chatter.type, chatter.encoding, chatter.node) == (
            "std_msgs/msg/String",
            "ros1",
            "/maker",
        )
        assert (chatter.latched, point.latched) == (False, True)
        assert ours.count(point) == COUNT
        stamps = sorted((stamp, channel.topic) for channel, stamp in ours.stamps())
        assert stamps == [(stamp, topic) for topic, stamp, _ in expected]


def test_ranges_topics_and_reverse(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "x.bag", _messages())
    with Ros1Reader(path) as bag:
        whole = [(one.channel.topic, one.stamp) for one in bag.messages()]
        assert [(one.channel.topic, one.stamp) for one in bag.messages(reverse=True)] == whole[::-1]
        low, high = START + 100_000_000, START + 200_000_000
        ranged = [(o.channel.topic, o.stamp) for o in bag.messages(["/chatter"], low, high)]
        assert ranged == [one for one in whole if one[0] == "/chatter" and low <= one[1] <= high]
        assert len(ranged) == 11


def test_chunks_that_overlap_are_merged(tmp_path: Path) -> None:
    shuffled = _messages(30_000)
    random.Random(4).shuffle(shuffled)
    path = write_bag(tmp_path / "x.bag", shuffled)
    with Ros1Reader(path) as bag:
        assert len(bag.chunks) > 1
        stamps = [one.stamp for one in bag.messages()]
        assert stamps == sorted(one[1] for one in shuffled)
        assert [one.stamp for one in bag.messages(reverse=True)] == stamps[::-1]


def _read(path: Path) -> tuple[list[bytes], list[str]]:
    problems: list[BagError] = []
    with Ros1Reader(path) as bag:
        found = [bytes(one.data) for one in bag.messages(damaged=problems.append)]
        problems += bag.problems
    return found, [str(one) for one in problems]


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_truncated_bag_gives_what_is_there(tmp_path: Path, compression: str) -> None:
    path = write_bag(tmp_path / "x.bag", _messages(40_000), compression=compression)
    whole, _ = _read(path)
    size = path.stat().st_size
    cuts = [*range(size // 1000 * 1000, 13, -max(size // 40_000, 1) * 1000)]
    counts = []
    for cut in cuts:
        os.truncate(path, cut)
        found, problems = _read(path)
        assert set(found) <= set(whole)
        assert all(str(path) in one and " at byte " in one for one in problems)
        assert problems
        counts.append(len(found))
    assert all(more >= fewer for more, fewer in pairwise(counts))
    assert counts[0] == len(whole)
    if compression == "none":  # the others decompress by large blocks only
        assert len(whole) > counts[len(counts) // 2] > 0


def test_without_permission_to_skip_damage_it_is_raised(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "x.bag", _messages())
    os.truncate(path, 8000)
    with Ros1Reader(path) as bag:
        assert not bag.indexed
        with pytest.raises(BagError, match=r"x\.bag at byte \d+: damaged"):
            list(bag.messages())


def test_a_bag_that_ends_within_its_header_has_one_problem(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "x.bag", _messages())
    os.truncate(path, 900)
    with Ros1Reader(path) as bag:
        assert [one.offset for one in bag.problems] == [13]


def test_damage_to_chunk_and_index_costs_no_more_than_what_it_hits(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "x.bag", _messages())
    whole, _ = _read(path)
    sound = path.read_bytes()
    for seed in range(200):
        chance = random.Random(seed)
        place = chance.randrange(13, len(sound))
        path.write_bytes(sound[:place] + chance.randbytes(6) + sound[place + 6 :])
        found, problems = _read(path)
        changed = len([one for one in found if one not in whole])
        assert len(found) >= len(whole) - 3 or problems, seed
        assert changed <= 3, seed


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "the file is empty"),
        (b"#ROSBAG V1.2\n", "a bag of version 1.2, expected 2.0"),
        (b"\x89MCAP0\r\n", "not a bag of ROS 1: it begins with"),
    ],
)
def test_what_is_no_bag_is_named(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "x.bag"
    path.write_bytes(content)
    with pytest.raises(BagError) as caught:
        Ros1Reader(path)
    assert str(caught.value).startswith(f"{path} at byte 0: {reason}")


@pytest.mark.parametrize("field", [b"index_pos=", b"chunk_pos="])
def test_a_place_beyond_all_files_is_damage(tmp_path: Path, field: bytes) -> None:
    path = write_bag(tmp_path / "x.bag", _messages())
    data = bytearray(path.read_bytes())
    begin = data.index(field) + len(field)
    data[begin : begin + 8] = b"\xff" * 8
    path.write_bytes(data)
    messages, problems = _read(path)
    assert len(messages) in {0, 2 * COUNT}
    assert "ends" in problems[0] or "expected" in problems[0]


def test_a_number_of_many_bytes_is_none() -> None:
    with pytest.raises(ros1_records.RecordError, match="without a number in its field 'count'"):
        ros1_records.number({"count": b"\xff" * 9}, "count", 0)


def test_what_looks_like_many_chunks_is_searched_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_bag(tmp_path / "x.bag", _messages())
    whole = path.read_bytes()
    begin = whole.index(b"compression=") - 40
    path.write_bytes(whole[:begin] + b"\xff" * 100 + b"compression=" * 2000 + whole[begin:])
    pread = Mock(side_effect=os.pread)
    monkeypatch.setattr(os, "pread", pread)
    messages, problems = _read(path)
    assert len(messages) == 2 * COUNT
    assert problems
    assert pread.call_count < 1000


@pytest.mark.parametrize("name", ["x.bag", "x.mcap"])
def test_many_channels_are_counted_at_once(tmp_path: Path, name: str) -> None:
    encoding, count = ("ros1" if name == "x.bag" else "cdr"), 20_000
    with create_writer(tmp_path / name) as writer:
        for number in range(count):
            channel = Channel(f"/t{number}", "std_msgs/msg/Empty", encoding, md5="0" * 32)
            writer.write(writer.add(channel), START, b"")
    begin = time.process_time()
    with open_reader(tmp_path / name) as reader:
        topics = summarize(name, reader).topics
    assert [topic.messages for topic in topics] == [1] * count
    assert time.process_time() - begin < 8
