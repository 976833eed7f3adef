"""Bags of ROS 1 that are written here, as Debian's rosbag reads them."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from oracle import PYTHON, require

import rosz.bags
from bags.messages import MESSAGES
from rosz.bags import Channel, Compression, open_reader
from rosz.bags.formats.ros1_form import to_cdr, to_ros1
from rosz.bags.opening import create_file
from rosz.errors import BagError, UsageError
from rosz.qos import LATCHED
from rosz.typestore import TypeStore

TYPES = TypeStore()
START = 1_700_000_000_000_000_000
READ = """
import json, sys
import rosbag
rows = []
with rosbag.Bag(sys.argv[1]) as bag:
    for topic, message, stamp, about in bag.read_messages(return_connection_header=True):
        callerid = about.get("callerid", b"")
        rows.append([topic, str(message), stamp.to_nsec(), message._type, message._md5sum,
                     about["md5sum"].decode(), callerid.decode(), "latching" in about])
print(json.dumps(rows))
"""


def write(path: Path, compression: Compression = "none", times: int = 3) -> None:
    """Write each message several times, as a recorder of ROS 1's format does."""
    with create_file(path, compression=compression, chunk_size=3000) as writer:
        handles = {}
        for topic, message in MESSAGES.items():
            cls = type(message)
            channel = Channel(
                topic,
                cls._type_name,
                definition=cls._full_text,
                qos=(LATCHED,) if topic == "/map" else (),
                node="/talker",
            )
            form, translate = to_ros1(channel, TYPES)
            handles[topic] = writer.add(form), translate
        for number in range(times):
            for index, (topic, message) in enumerate(MESSAGES.items()):
                handle, translate = handles[topic]
                stamp = START + number * 1_000_000_000 + index
                writer.write(handle, stamp, translate(message.to_cdr(), number))


def test_programs_write_messages_into_it(tmp_path: Path) -> None:
    with rosz.bags.open(tmp_path / "a.bag", "w", compression="bz2") as bag:
        for number, (topic, message) in enumerate(MESSAGES.items()):
            bag.write(topic, message, START + number)
    with rosz.bags.open(tmp_path / "a.bag") as bag:
        assert {one.encoding for one in bag.channels} == {"ros1"}
        assert [(one.topic, one.message) for one in bag.messages()] == list(MESSAGES.items())


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_what_is_written_is_read(tmp_path: Path, compression: Compression) -> None:
    write(tmp_path / "a.bag", compression)
    with open_reader(tmp_path / "a.bag") as reader:
        assert not reader.problems
        assert {chunk.compression for chunk in reader.chunks} == {compression}
        found = list(reader.messages())
        assert [one.stamp for one in found[:20]] == [START + index for index in range(20)]
        assert len(found) == 3 * len(MESSAGES)
        for one in found:
            form, translate = to_cdr(one.channel, TYPES)
            assert translate(one.data) == MESSAGES[one.channel.topic].to_cdr()
            assert form.type == one.channel.type
            assert one.channel.latched == (one.channel.topic == "/map")


@pytest.mark.ros1
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_debian_reads_the_same(tmp_path: Path, compression: Compression) -> None:
    require("rosbag", package="python3-rosbag")
    write(tmp_path / "a.bag", compression)
    done = subprocess.run(
        [PYTHON, "-c", READ, str(tmp_path / "a.bag")],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "md5" not in done.stderr
    rows = json.loads(done.stdout)
    assert len(rows) == 3 * len(MESSAGES)
    for index, row in enumerate(rows):
        topic, text, stamp, kind, md5, claimed, callerid, latching = row
        number, place = divmod(index, len(MESSAGES))
        expected = MESSAGES[topic]
        if hasattr(expected, "header"):
            assert f"seq: {number}" in text
        assert stamp == START + number * 1_000_000_000 + place
        assert (kind, md5, claimed) == (expected._type, expected._md5sum, expected._md5sum)
        assert (callerid, latching) == ("/talker", topic == "/map")
    texts = {row[0]: row[1] for row in rows}
    assert texts["/string"] == 'data: "gr\\xFC\\xDFe, \\u4E16\\u754C"'
    assert "K: [0.0, 0.0" in texts["/camera_info"]
    assert "data: [0, 1, 2, 3, 4, 5]" in texts["/image"]


def test_what_the_format_cannot_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no compression 'zstd'; they have bz2 and lz4"):
        create_file(tmp_path / "a.bag", compression="zstd")
    with (
        create_file(tmp_path / "a.bag") as writer,
        pytest.raises(BagError, match="cannot hold messages of '/a' as cdr"),
    ):
        writer.add(Channel("/a", "std_msgs/msg/String"))
