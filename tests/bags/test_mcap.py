"""MCAP files: written and read here, and by the library ``mcap``."""

from __future__ import annotations

import json
import random
import tarfile
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

import rosz.bags
from rosz.bags import (
    Attachment,
    Channel,
    Compression,
    McapReader,
    McapWriter,
    create_writer,
    open_reader,
)
from rosz.bags.formats.channel_text import parse_profiles
from rosz.errors import BagError, UsageError
from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.std_msgs.msg import String
from rosz.qos import LATCHED, SENSOR_DATA, QoS

CHANNELS = [
    Channel("/chatter", "std_msgs/msg/String", definition="string data\n", node="/talker"),
    Channel("/map", "std_msgs/msg/String", definition="string data\n", qos=(LATCHED,)),
    Channel("/scan", "a/msg/B", definition="int32 x\n", qos=(SENSOR_DATA,), type_hash="RIHS01_1"),
]


def write(path: Path, count: int = 3000, compression: Compression = "none") -> list[bytes]:
    """Write messages of three channels in disorder; return their payloads."""
    rng = random.Random(1)
    payloads = [rng.randbytes(rng.randrange(4, 300)) for _ in range(count)]
    with McapWriter(path, compression=compression, chunk_size=20_000) as writer:
        handles = [writer.add(channel) for channel in CHANNELS]
        for number, payload in enumerate(payloads):
            stamp = 1000 + number + rng.randrange(5)
            writer.write(handles[number % 3], stamp, payload, stamp - 1, number)
        writer.add_metadata("rosz", {"a": "b"})
        writer.add_attachment(Attachment("x.txt", "text/plain", 7, b"hello"))
    return payloads


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("scan", [False, True])
def test_what_is_written_is_read(tmp_path: Path, compression: Compression, scan: bool) -> None:
    payloads = write(tmp_path / "a.mcap", compression=compression)
    with McapReader(tmp_path / "a.mcap", scan=scan) as reader:
        assert reader.indexed != scan
        assert not reader.problems
        assert list(reader.channels) == CHANNELS
        assert reader.count() == len(payloads)
        assert [reader.count(channel) for channel in CHANNELS] == [1000, 1000, 1000]
        found = list(reader.messages())
        assert [one.stamp for one in found] == sorted(one.stamp for one in found)
        assert (found[0].stamp, found[-1].stamp) == (reader.start, reader.end)
        assert {one.sequence: one.data for one in found} == dict(enumerate(payloads))
        assert all(one.sent == one.stamp - 1 for one in found)
        assert list(reader.messages(reverse=True)) == found[::-1]
        part = list(reader.messages({"/map", "/scan"}, 1500, 1600))
        assert part == [
            one
            for one in found
            if one.channel.topic in {"/map", "/scan"} and 1500 <= one.stamp <= 1600
        ]
        assert reader.metadata == {"rosz": {"a": "b"}}
        assert list(reader.attachments()) == [Attachment("x.txt", "text/plain", 7, b"hello")]
        assert len(reader.chunks) > 10


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_the_library_reads_the_same(tmp_path: Path, compression: Compression) -> None:
    payloads = write(tmp_path / "a.mcap", compression=compression)
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(payloads)
        rows = {message.sequence: message.data for _, _, message in reader.iter_messages()}
        assert rows == dict(enumerate(payloads))
        assert [one.name for one in reader.iter_attachments()] == ["x.txt"]
        assert [one.metadata for one in reader.iter_metadata()] == [{"a": "b"}]


def test_conformance_files_give_what_they_hold(tmp_path: Path) -> None:
    """The files are those of MCAP's conformance tests: 416 forms of six contents, with the records
    of each content in one description."""
    with tarfile.open(Path(__file__).parent / "mcap_conformance.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    files = sorted(tmp_path.glob("*/*.mcap"))
    assert len(files) == 416
    wrong = []
    for file in files:
        expected = conformance_contents(file.with_name(f"{file.parent.name}.json"))
        for scan in (False, True):
            with McapReader(file, scan=scan) as reader:
                assert (reader.problems, reader.count()) == ([], len(expected[0])), file.name
                found = (
                    [
                        (*_about(one.channel), one.stamp, one.sent, one.sequence, one.data)
                        for one in reader.messages()
                    ],
                    dict(reader.metadata),
                    list(reader.attachments()),
                    [_about(one) for one in reader.channels],
                )
            if found != expected:
                wrong.append((file.name, scan))
    assert not wrong


def conformance_contents(file: Path) -> tuple[Any, ...]:
    """Return the messages, metadata, attachments and channels that a description tells."""
    rows = [(row["type"], dict(row["fields"])) for row in json.loads(file.read_text())["records"]]
    schemas = {row["id"]: row for kind, row in rows if kind == "Schema"}
    channels = {row["id"]: row for kind, row in rows if kind == "Channel"}

    def about(channel: dict[str, Any]) -> tuple[str, ...]:
        schema = schemas.get(channel["schema_id"], {"name": "", "encoding": "", "data": []})
        text = _octets(schema["data"]).decode()
        return (
            channel["topic"],
            channel["message_encoding"],
            schema["name"],
            schema["encoding"],
            text,
        )

    messages: list[tuple[Any, ...]] = [
        (
            *about(channels[row["channel_id"]]),
            int(row["log_time"]),
            int(row["publish_time"]),
            int(row["sequence"]),
            _octets(row["data"]),
        )
        for kind, row in rows
        if kind == "Message"
    ]
    return (
        sorted(messages, key=lambda message: message[5]),
        {row["name"]: row["metadata"] for kind, row in rows if kind == "Metadata"},
        [
            Attachment(row["name"], row["media_type"], int(row["log_time"]), _octets(row["data"]))
            for kind, row in rows
            if kind == "Attachment"
        ],
        [about(channel) for channel in channels.values()],
    )


def _octets(numbers: list[str]) -> bytes:
    return bytes(map(int, numbers))


def _about(channel: Channel) -> tuple[str, ...]:
    return channel.topic, channel.encoding, channel.type, channel.language, channel.definition


def test_programs_read_messages(tmp_path: Path) -> None:
    pose = PoseStamped()
    pose.header.frame_id = "map"
    pose.pose.position.x = 1.5
    with rosz.bags.open(tmp_path / "a.mcap", "w", compression="zstd") as output:
        output.write("/chatter", String(data="hello"), 5)
        output.write("/pose", pose, 6)
    with rosz.bags.open(tmp_path / "a.mcap") as bag:
        assert bag.topics == {"/chatter": "std_msgs/msg/String", "/pose": pose._type_name}
        assert [entry.message for entry in bag.messages()] == [String(data="hello"), pose]
        assert [entry.stamp for entry in bag.messages("/pose")] == [6]
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = [row.decoded_message for row in reader.iter_decoded_messages()]
    assert decoded[0].data == "hello"
    assert decoded[1].pose.position.x == 1.5


def test_an_unfinished_file_reads_up_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = McapWriter(path, chunk_size=10_000)
    handle = writer.add(CHANNELS[0])
    for number in range(100):
        writer.write(handle, number, bytes(1000))
    writer.flush()
    whole = path.read_bytes()
    writer.close()
    sizes = []
    for size in range(60, len(whole), 997):
        path.write_bytes(whole[:size])
        with McapReader(path) as reader:
            assert not reader.indexed
            assert reader.problems
            found = list(reader.messages())
            assert len(found) == reader.count()
            sizes.append(len(found))
    assert sizes == sorted(sizes)
    assert sizes[-1] >= 80


def test_a_damaged_chunk_is_named_and_the_rest_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    payloads = write(path)
    with McapReader(path) as reader:
        chunk = reader.chunks[3]
    data = bytearray(path.read_bytes())
    data[chunk.offset + 500] ^= 1
    path.write_bytes(data)
    with McapReader(path) as reader:
        with pytest.raises(BagError, match="checksum") as caught:
            list(reader.messages())
        assert caught.value.offset == chunk.offset
        problems: list[BagError] = []
        found = list(reader.messages(damaged=problems.append))
        assert [one.offset for one in problems] == [chunk.offset]
        assert len(payloads) - 300 < len(found) < len(payloads)


def test_a_damaged_index_is_named_and_made_anew(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    payloads = write(path)
    data = bytearray(path.read_bytes())
    data[-100] ^= 1
    path.write_bytes(data)
    with McapReader(path) as reader:
        assert [str(one) for one in reader.problems] == [
            f"{path}: its index is damaged: its checksum is wrong"
        ]
        assert len(list(reader.messages())) == len(payloads)


def test_a_negative_time_of_a_publisher_is_none(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "a.mcap") as writer:
        writer.write(writer.add(CHANNELS[0]), 5, b"kept", -1, -1)
    with McapReader(tmp_path / "a.mcap") as reader:
        assert [(one.data, one.sent) for one in reader.messages()] == [(b"kept", 0)]


@pytest.mark.parametrize(
    "text",
    [
        "- " + "[" * 5000,
        f"- depth: {'9' * 5000}",
        "- {history: [], durability: {}, depth: [], lifespan: {sec: x, nsec: []}}",
    ],
)
def test_odd_qos_is_that_of_no_publisher(text: str) -> None:
    assert parse_profiles(text) in {(), (QoS(),)}


@pytest.mark.parametrize(("name", "latest"), [("a.bag", (1 << 32) * 10**9), ("a.mcap", 1 << 64)])
def test_times_that_a_format_cannot_hold(tmp_path: Path, name: str, latest: int) -> None:
    encoding = "ros1" if name == "a.bag" else "cdr"
    with create_writer(tmp_path / name) as writer:
        handle = writer.add(Channel("/a", "std_msgs/msg/String", encoding, md5="0" * 32))
        for stamp in (-1, 5, (1 << 64) - 1):
            writer.write(handle, stamp, b"kept")
    with open_reader(tmp_path / name) as reader:
        assert [one.stamp for one in reader.messages()] == [0, 5, latest - 1]


def test_any_bytes_are_read_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write(path, 300, "lz4")
    whole = path.read_bytes()
    rng = random.Random(2)
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(rng.randrange(1, 4)):
            data[rng.randrange(8, len(data))] = rng.randrange(256)
        path.write_bytes(data)
        with McapReader(path) as reader:
            list(reader.messages(damaged=lambda _: None))


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"mine")
    with pytest.raises(BagError, match="File exists"):
        McapWriter(path)
    with pytest.raises(BagError, match="not a bag"):
        rosz.bags.open(path)
    with pytest.raises(UsageError, match="does not tell the format"):
        rosz.bags.open(tmp_path / "a.txt", "x")
    assert path.read_bytes() == b"mine"
