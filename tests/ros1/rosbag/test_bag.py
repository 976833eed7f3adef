"""rosbag: what is beside reading and writing of bags."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

import rosz.ros1.tools.rosbag as rosbag_here
from rosz.ros1.tools.rosbag import (
    Bag,
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
)


def test_encryption_is_refused(tmp_path: Path) -> None:
    with Bag(str(tmp_path / "x.bag"), "w") as bag:
        bag.set_encryptor()
        bag.set_encryptor("rosbag/NoEncryptor")
        with pytest.raises(ROSBagEncryptNotSupportedException, match="does not encrypt bags"):
            bag.set_encryptor("rosbag/AesCbcEncryptor", "*user")
    path = tmp_path / "x.bag"
    data = path.read_bytes()
    field = b"encryptor=rosbag/AesCbcEncryptor"
    size = len(field) + 4
    head = int.from_bytes(data[13:17], "little")
    # The padding behind the header makes room for the field.
    body = data[17 : 17 + head] + len(field).to_bytes(4, "little") + field
    padding = int.from_bytes(data[17 + head : 21 + head], "little") - size
    rest = data[21 + head + size :]
    path.write_bytes(
        data[:13]
        + (head + size).to_bytes(4, "little")
        + body
        + padding.to_bytes(4, "little")
        + rest
    )
    with pytest.raises(ROSBagEncryptNotSupportedException, match="'rosbag decrypt' of ROS 1"):
        Bag(str(path))
    assert issubclass(ROSBagEncryptException, ROSBagException)


def test_bags_are_written_to_streams(tmp_path: Path) -> None:
    from rosz.msgs.std_msgs.msg import Int32

    path = tmp_path / "x.bag"
    with path.open("wb") as stream, Bag(stream, "w") as bag:
        assert bag.get_message_count() == 0
        with pytest.raises(ROSBagException, match="Bag contains no message"):
            bag.get_start_time()
        bag.write("/int", Int32(data=5))
    with path.open("rb") as source, Bag(source) as bag:
        assert [message.data for _, message, _ in bag] == [5]


def test_the_names_of_ros_1_are_there() -> None:
    for name in ("Bag", "Compression", "rosbagmain", "ROSBagUnindexedException"):
        assert hasattr(rosbag_here, name)


def test_a_replacement_for_migration_by_rules_is_named() -> None:
    with pytest.raises(ImportError, match="'rosz bag play' converts messages of older definitions"):
        import_module("rosbag.migration")
