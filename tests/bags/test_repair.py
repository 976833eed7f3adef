"""Bags that are damaged or unfinished: recovered, indexed, compressed."""

from __future__ import annotations

import json
import random
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from rosz.bags import Channel, Compression, McapReader, McapWriter, open_reader
from rosz.bags.edit.repair import check_bag, recover, rewrite
from rosz.bags.formats.ros1_writer import Ros1Writer
from rosz.cli.main import run
from rosz.errors import BagError
from rosz.msgs.std_msgs.msg import String

NO_ROOM = """
import resource, sys
from rosz.cli.main import run
_, most = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, most))
for words in sys.argv[1:]:
    print(run(["bag", *words.split()]), file=sys.stderr)
"""
CHATTER = Channel("/chatter", "std_msgs/msg/String", definition="string data\n")
ROS1_CHATTER = Channel("/chatter", "std_msgs/msg/String", "ros1", "string data\n", String._md5sum)
COUNT = 500


def unfinished(path: Path) -> bytes:
    """Write a bag as it is before its recorder ends; return the bytes of the finished one."""
    with McapWriter(path, chunk_size=4000) as writer:
        handle = writer.add(CHATTER)
        for number in range(COUNT):
            writer.write(handle, number, String(data=f"hello {number}").to_cdr())
        writer.flush()
        begun = path.read_bytes()
    whole = path.read_bytes()
    path.write_bytes(begun)
    return whole


def test_reindex_replaces_the_bag_and_keeps_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    whole = unfinished(path)
    begun = path.read_bytes()
    copied = rewrite(path, None)
    assert (copied.count, copied.backup) == (COUNT, tmp_path / "a.orig.mcap")
    assert (tmp_path / "a.orig.mcap").read_bytes() == begun
    with McapReader(path) as reader:
        assert reader.indexed
        assert [one.data for one in reader.messages()] == [
            String(data=f"hello {number}").to_cdr() for number in range(COUNT)
        ]
    path.write_bytes(whole)
    with pytest.raises(BagError, match="exists already; -f replaces it"):
        rewrite(path, None)
    assert path.read_bytes() == whole
    assert rewrite(path, "zstd", force=True).count == COUNT
    assert path.stat().st_size < len(whole) / 2
    assert {one.name for one in tmp_path.iterdir()} == {"a.mcap", "a.orig.mcap"}


def test_an_active_bag_gets_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap.active"
    unfinished(path)
    assert rewrite(path, None).path == tmp_path / "a.mcap"
    assert path.exists()
    with pytest.raises(BagError, match="exists already"):
        rewrite(path, None)


def test_a_bag_that_is_being_written_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap.active"
    with McapWriter(path) as writer:
        writer.write(writer.add(CHATTER), 1, String(data="hello").to_cdr())
        writer.flush()
        with McapReader(path) as reader:
            (problem,) = reader.problems
            assert "it is being recorded" in str(problem)
            assert reader.count() == 1
        with pytest.raises(BagError, match="it is being recorded; end the recorder first"):
            rewrite(path, None)
        data = path.read_bytes()
    path.write_bytes(data)  # as after the writer was killed
    with McapReader(path) as reader:
        (problem,) = reader.problems
        assert "as after a recorder was killed" in str(problem)
    assert rewrite(path, None).count == 1


def test_the_rest_of_a_damaged_bag_is_recovered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, target = tmp_path / "a.mcap", tmp_path / "b.mcap"
    path.write_bytes(unfinished(path))
    with McapReader(path) as reader:
        chunk = reader.chunks[2]
    data = bytearray(path.read_bytes())
    data[chunk.offset + 300] ^= 4
    path.write_bytes(data)

    with open_reader(path) as reader:
        count, problems = check_bag(reader)
    assert [one.offset for one in problems] == [chunk.offset]
    assert run(["bag", "check", str(path)]) == 1
    assert f"ERROR: {path} at byte {chunk.offset}: the checksum" in capsys.readouterr().err
    assert run(["bag", "fix", str(path), str(target)]) == 1
    captured = capsys.readouterr()
    assert captured.out == f"{target}: {count} messages\n"
    assert f"{path} at byte {chunk.offset}" in captured.err
    assert run(["bag", "check", str(target), "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row == {"bag": str(target), "messages": count, "problems": [], "types": {}}
    assert run(["bag", "fix", str(path), str(target)]) == 1
    assert "File exists" in capsys.readouterr().err


def test_a_bag_cut_anywhere_is_recovered_up_to_there(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    whole = unfinished(path)
    counts = []
    for size in range(100, len(whole), 1000):
        path.write_bytes(whole[:size])
        copied = recover(path, tmp_path / f"{size}.mcap")
        counts.append(copied.count)
        with open_reader(copied.path) as reader:
            assert check_bag(reader) == (copied.count, [])
    assert counts == sorted(counts)
    assert counts[-1] == COUNT


def test_compress_and_decompress(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(unfinished(path))
    folder = tmp_path / "out"
    folder.mkdir()
    assert run(["bag", "compress", "--lz4", str(path), "--output-dir", str(folder)]) == 0
    assert capsys.readouterr().out == f"{folder / 'a.mcap'}: {COUNT} messages\n"
    with McapReader(folder / "a.mcap") as reader:
        assert {one.compression for one in reader.chunks} == {"lz4"}
    assert run(["bag", "decompress", "-q", str(folder / "a.mcap")]) == 0
    assert capsys.readouterr().out == ""
    with McapReader(folder / "a.mcap") as reader:
        assert {one.compression for one in reader.chunks} == {"none"}
        assert reader.count() == COUNT
    assert run(["bag", "compress", "-j", str(path)]) == 2
    assert "MCAP has no compression 'bz2'" in capsys.readouterr().err
    assert path.exists()
    assert run(["bag", "reindex", str(tmp_path / "none.mcap")]) == 1
    assert "cannot open it: No such file" in capsys.readouterr().err


def test_types_that_differ_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    with McapWriter(path) as writer:
        handle = writer.add(Channel("/a", "std_msgs/msg/String", definition="string text\n"))
        writer.write(handle, 1, random.Random(1).randbytes(8))
    assert run(["bag", "check", str(path)]) == 1
    assert "std_msgs/msg/String: its hash is " in capsys.readouterr().out


def test_what_is_left_of_a_bag_for_which_there_is_no_room(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "a.mcap") as writer:
        handle = writer.add(CHATTER)
        for number in range(COUNT):
            writer.write(handle, number, String(data="hello" * 1000).to_cdr())
    begun = (tmp_path / "a.mcap").read_bytes()
    words = ("reindex a.mcap", "filter a.mcap b.mcap", "filter a.mcap c.bag", "convert a.mcap d/")
    command = [sys.executable, "-c", NO_ROOM, *words]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=True, timeout=300
    )
    told = [line for line in done.stderr.splitlines() if "write" in line or line.isdigit()]
    removed = "cannot write it: File too large; what was written has been removed"
    assert told[:-2] == [
        *(f"ERROR: a.mcap: {removed}", "1"),
        *(f"ERROR: b.mcap: {removed}", "1"),
        *(f"ERROR: c.bag: {removed}", "1"),
    ]
    assert told[-2].startswith("ERROR: d/d_0.mcap at byte ")
    assert told[-2].endswith(
        "cannot write to it: File too large; what was written before can be read"
    )
    assert {one.name for one in tmp_path.iterdir()} == {"a.mcap", "d"}
    assert (tmp_path / "a.mcap").read_bytes() == begun
    with open_reader(tmp_path / "d") as reader:
        count, _ = check_bag(reader)
    assert 0 < count < COUNT


@pytest.mark.parametrize("compression", ["none", "bz2"])
def test_a_chunk_that_was_begun_is_recovered(tmp_path: Path, compression: Compression) -> None:
    """ROS 1's recorder fills in the size of a chunk when that is full."""
    path = tmp_path / "a.bag.active"
    with Ros1Writer(path, compression=compression) as writer:
        handle = writer.add(ROS1_CHATTER)
        for number in range(COUNT):
            writer.write(handle, number, String(data=f"hello {number}").to_ros1())
        writer.flush()
        data = bytearray(path.read_bytes())
    place = data.index(b"size=") + 5
    (size,) = struct.unpack_from("<I", data, place + 4)
    data[place : place + 8] = bytes(8)
    begun = data[: place + 8 + size]
    path.write_bytes(begun)
    assert run(["bag", "reindex", str(path)]) == (0 if compression == "none" else 1)
    with open_reader(tmp_path / "a.bag") as reader:
        assert reader.indexed
        assert reader.count() == COUNT


def test_an_empty_copy_of_a_killed_bag_is_no_success(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.bag.active"
    with Ros1Writer(path):
        pass
    data = path.read_bytes()
    place = data.index(b"index_pos=") + 10
    path.write_bytes(data[:place] + bytes(8) + data[place + 8 :])
    assert run(["bag", "reindex", str(path)]) == 1
    assert "killed before it had written one" in capsys.readouterr().err
