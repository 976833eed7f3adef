"""The reader of rosbag2's bags."""

from __future__ import annotations

from pathlib import Path

import pytest
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import rosz.bags
from rosz.bags import find_format, open_reader
from rosz.errors import BagError

STORE = get_typestore(Stores.ROS2_JAZZY)
STRING = STORE.types["std_msgs/msg/String"]
_NO_TIME = QosTime(0, 0)
LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    _NO_TIME,
    _NO_TIME,
    QosLiveliness.AUTOMATIC,
    _NO_TIME,
    avoid_ros_namespace_conventions=False,
)


def _write(path: Path, plugin: StoragePlugin, mode: CompressionMode | None = None) -> Path:
    writer = Writer(path, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        name = "std_msgs/msg/String"
        chatter = writer.add_connection("/chatter", name, typestore=STORE)
        latched = writer.add_connection(
            "/latched", name, typestore=STORE, offered_qos_profiles=[LATCHED]
        )
        for number in range(20):
            data = STORE.serialize_cdr(STRING(data=f"hello {number}"), name)
            writer.write(latched if number == 3 else chatter, 1000 + number, data)
    return path


@pytest.mark.parametrize(
    ("plugin", "mode"),
    [
        (StoragePlugin.SQLITE3, None),
        (StoragePlugin.SQLITE3, CompressionMode.FILE),
        (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
        (StoragePlugin.MCAP, None),
        (StoragePlugin.MCAP, CompressionMode.FILE),
    ],
)
def test_folders_read_with_their_qos_and_definitions(
    tmp_path: Path, plugin: StoragePlugin, mode: CompressionMode | None
) -> None:
    path = _write(tmp_path / "x", plugin, mode)
    with rosz.bags.open(path) as bag:
        assert (find_format(path), bag.start, bag.end, bag.count()) == ("rosbag2", 1000, 1019, 20)
        texts = [one.message.data for one in bag.messages()]  # type: ignore[attr-defined]
        assert texts == [f"hello {number}" for number in range(20)]
        assert [one.stamp for one in bag.messages("/latched")] == [1003]
        assert [one.stamp for one in bag.messages(None, 1002, 1004, reverse=True)] == [
            1004,
            1003,
            1002,
        ]
        assert {one.topic: one.latched for one in bag.channels} == {
            "/chatter": False,
            "/latched": True,
        }
        assert all("string data" in one.definition for one in bag.channels)


def test_a_folder_without_metadata_and_a_file_alone_read(tmp_path: Path) -> None:
    path = _write(tmp_path / "x", StoragePlugin.SQLITE3)
    (path / "metadata.yaml").unlink()
    (file,) = path.glob("*.db3")
    for one in (path, file):
        with open_reader(one) as bag:
            assert len(list(bag.messages())) == bag.count() == 20


def test_damage_is_named_and_the_rest_is_read(tmp_path: Path) -> None:
    path = _write(tmp_path / "x", StoragePlugin.SQLITE3)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    with open_reader(path) as bag:
        assert bag.count() == 20
        assert "metadata.yaml: damaged, not used" in str(bag.problems[0])
    (file,) = path.glob("*.db3")
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(BagError, match=r"\.db3: not a bag of rosbag2, or damaged"):
        open_reader(path)
    for one in path.iterdir():
        one.unlink()
    with pytest.raises(BagError, match=r"the folder has no metadata\.yaml, and no"):
        open_reader(path)
