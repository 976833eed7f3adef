"""Bags of each format made of those of each other one; folders of rosbag2 as rosbags reads them."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
import yaml
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from bags.messages import MESSAGES
from rosz.bags import Attachment, Channel, McapWriter, open_reader
from rosz.bags.formats.ros1_form import to_cdr
from rosz.cli.main import run
from rosz.qos import FOREVER, LATCHED, SENSOR_DATA, QoS
from rosz.typestore import TypeStore

TYPES = TypeStore()
START = 1_700_000_000_000_000_000
FORMS = {
    "mcap": ("x.mcap", []),
    "bag": ("x.bag", []),
    "bag bz2": ("bz2.bag", ["--compression", "bz2"]),
    "bag lz4": ("lz4.bag", ["--compression", "lz4"]),
    "rosbag2 mcap": ("folder/", ["--compression", "lz4"]),
    "rosbag2 sqlite3": ("sqlite", ["--to", "rosbag2", "--storage", "sqlite3"]),
    "rosbag2 zstd": ("zstd", ["--storage", "sqlite3", "--compression", "zstd"]),
}
QOS = {
    "/map": (LATCHED,),
    "/scan": (SENSOR_DATA, QoS(depth=3, history="keep_all", deadline=1_500_000_000)),
    "/tf": (QoS(depth=7, liveliness="manual_by_topic", lease=FOREVER),),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write each message twice, with all that a bag can hold."""
    path = tmp_path_factory.mktemp("bags") / "whole.mcap"
    with McapWriter(path) as writer:
        writer.add_metadata("parameters", {"yaml": "a: 1\n", "ü": "b"})
        writer.add_attachment(Attachment("x.txt", "text/plain", 7, b"hello"))
        for index, (topic, message) in enumerate(MESSAGES.items()):
            cls = type(message)
            channel = Channel(
                topic,
                cls._type_name,
                definition=cls._full_text,
                md5=cls._md5sum,
                type_hash=cls._type_hash,
                qos=QOS.get(topic, (QoS(),)),
            )
            handle = writer.add(channel)
            for number in (0, 1):
                writer.write(handle, START + 1000 * number + index, message.to_cdr())
    return path


def contents(path: Path) -> list[tuple[str, str, int, bytes]]:
    """Return topic, type, stamp and CDR of each message."""
    found = []
    with open_reader(path) as reader:
        assert not reader.problems
        for one in reader.messages():
            _, translate = to_cdr(one.channel, TYPES)
            row = (one.channel.topic, one.channel.type, one.stamp, translate(one.data))
            found.append(row)
    return found


PAIRED = {name: form for name, form in FORMS.items() if name != "rosbag2 zstd"}


@pytest.mark.parametrize("source", PAIRED)
def test_every_format_becomes_every_other(
    whole: Path, tmp_path: Path, source: str, capsys: pytest.CaptureFixture[str]
) -> None:
    name, options = FORMS[source]
    begun = tmp_path / name
    assert run(["bag", "convert", str(whole), f"{tmp_path}/{name}", *options]) == 0
    expected = contents(whole)
    assert len(expected) == 2 * len(MESSAGES)
    for number, (name, options) in enumerate(PAIRED.values()):
        folder = tmp_path / str(number)
        folder.mkdir()
        assert run(["bag", "convert", str(begun), f"{folder}/{name}", *options]) == 0
        assert contents(folder / name) == expected
        with open_reader(folder / name) as reader:
            assert [one.topic for one in reader.channels if one.latched] == ["/map"]
    assert not capsys.readouterr().err


@pytest.mark.parametrize("form", ["rosbag2 mcap", "rosbag2 sqlite3", "rosbag2 zstd"])
def test_rosbags_reads_the_folder_the_same(whole: Path, tmp_path: Path, form: str) -> None:
    name, options = FORMS[form]
    assert run(["bag", "convert", str(whole), f"{tmp_path}/{name}", *options]) == 0
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(tmp_path / name) as reader:
        found = []
        for connection, stamp, data in reader.messages():
            found.append((connection.topic, connection.msgtype, stamp, bytes(data)))
            store.deserialize_cdr(data, connection.msgtype)
        stamps = [row[2] for row in found]
        assert found == contents(whole)
        assert (reader.start_time, reader.end_time) == (stamps[0], stamps[-1] + 1)
        assert reader.message_count == len(found)
        assert reader.ros_distro == "jazzy"
        for connection in reader.connections:
            assert connection.msgcount == 2
            cls = type(MESSAGES[connection.topic])
            assert connection.digest == cls._type_hash
            assert connection.msgdef.data == cls._full_text
            assert isinstance(connection.ext, ConnectionExtRosbag2)
            expected = QOS.get(connection.topic, (QoS(),))
            for theirs, ours in zip(connection.ext.offered_qos_profiles, expected, strict=True):
                assert theirs.depth == ours.depth
                names = theirs.history, theirs.reliability, theirs.durability, theirs.liveliness
                assert [one.name.lower() for one in names] == [
                    ours.history,
                    ours.reliability,
                    ours.durability,
                    ours.liveliness,
                ]
                times = theirs.deadline, theirs.lifespan, theirs.liveliness_lease_duration
                assert [one.sec * 10**9 + one.nsec for one in times] == [
                    ours.deadline,
                    ours.lifespan,
                    ours.lease,
                ]


def test_the_folder_is_as_jazzy_writes_it(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    assert run(["bag", "convert", str(whole), str(folder), "--storage", "sqlite3"]) == 0
    assert sorted(one.name for one in folder.iterdir()) == ["metadata.yaml", "run_0.db3"]
    text = yaml.safe_load((folder / "metadata.yaml").read_text())
    about = text["rosbag2_bagfile_information"]
    assert (about["version"], about["storage_identifier"]) == (9, "sqlite3")
    assert about["relative_file_paths"] == [about["files"][0]["path"]] == ["run_0.db3"]
    assert about["message_count"] == 2 * len(MESSAGES)
    (database,) = folder.glob("*.db3")
    with sqlite3.connect(database) as connection:
        assert connection.execute("SELECT * FROM schema").fetchall() == [(4, "jazzy")]
        ((version, inner),) = connection.execute("SELECT metadata_version, metadata FROM metadata")
    connection.close()
    assert (version, yaml.safe_load(inner)) == (9, about)
    with open_reader(folder) as reader:
        assert reader.metadata == {"parameters": {"yaml": "a: 1\n", "ü": "b"}}


def test_metadata_and_files_go_through_a_folder(whole: Path, tmp_path: Path) -> None:
    assert run(["bag", "convert", str(whole), f"{tmp_path}/run/"]) == 0
    assert run(["bag", "convert", str(tmp_path / "run"), str(tmp_path / "back.mcap")]) == 0
    with open_reader(whole) as first, open_reader(tmp_path / "back.mcap") as last:
        assert last.metadata == first.metadata
        assert list(last.attachments()) == list(first.attachments())


def test_an_empty_bag_becomes_a_folder(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "empty.mcap"):
        pass
    for storage in ("mcap", "sqlite3"):
        folder = tmp_path / storage
        source = str(tmp_path / "empty.mcap")
        assert run(["bag", "convert", source, str(folder), "--storage", storage]) == 0
        assert contents(folder) == []
        with Reader(folder) as reader:
            assert reader.message_count == 0


def test_wrong_outputs_are_named(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = str(whole)

    def refused(*words: str) -> str:
        assert run(["bag", "convert", bag, *words]) in {1, 2}
        return capsys.readouterr().err

    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes").write_text("mine")
    assert "exists, and is not empty" in refused(f"{tmp_path}/full/")
    assert (tmp_path / "full" / "notes").read_text() == "mine"
    assert "does not tell the format" in refused(str(tmp_path / "run"))
    assert "--to is 'db3'; expected mcap, rosbag, rosbag2" in refused("x", "--to", "db3")
    assert "expected mcap or sqlite3" in refused("x", "--storage", "db3")
    assert "--storage is for rosbag2" in refused("x.bag", "--storage", "mcap", "--to", "rosbag")
    odd = refused(f"{tmp_path}/odd/", "--storage", "sqlite3", "--compression", "lz4")
    assert "SQLite storage has no compression 'lz4'" in odd
    assert not (tmp_path / "odd").exists()
    assert "cannot create it: Not a directory" in refused(f"{tmp_path}/full/notes/x/")


def test_a_folder_without_metadata_is_given_it(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    assert run(["bag", "convert", str(whole), str(folder), "--storage", "sqlite3"]) == 0
    (folder / "metadata.yaml").unlink()
    assert run(["bag", "reindex", str(folder)]) == 0
    assert f"the old bag is {folder}.orig" in capsys.readouterr().out
    with Reader(folder) as reader:
        assert reader.message_count == 2 * len(MESSAGES)
    assert contents(folder) == contents(whole)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["run", "run.orig"]
    assert run(["bag", "compress", "-f", str(folder)]) == 0
    with Reader(folder) as reader:
        assert reader.compression_mode == "message"
    assert contents(folder) == contents(whole)
    assert run(["bag", "split", str(folder), "--duration", "0.0000005"]) == 0
    assert len(contents(tmp_path / "run_0")) == len(MESSAGES)
    assert run(["bag", "reindex", str(next(folder.glob("*.db3")))]) == 1
    assert "give the folder" in capsys.readouterr().err
