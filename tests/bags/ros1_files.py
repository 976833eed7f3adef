"""Bags of ROS 1 for tests, written by the rosbags library."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

__all__ = ("STORE", "write_bag")

STORE = get_typestore(Stores.ROS1_NOETIC)


def write_bag(
    path: Path,
    messages: Iterable[tuple[str, int, object]],
    *,
    compression: str = "none",
    latched: Iterable[str] = (),
) -> Path:
    """Write messages of ROS 1 (topic, stamp, message of `STORE`) into a bag."""
    writer = Writer(path)
    if compression != "none":
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    with writer:
        connections = {}
        for topic, stamp, message in messages:
            name: str = message.__msgtype__  # type: ignore[attr-defined]
            if topic not in connections:
                latching = int(topic in latched)
                connections[topic] = writer.add_connection(
                    topic, name, typestore=STORE, callerid="/maker", latching=latching
                )
            data = STORE.serialize_ros1(message, name)
            writer.write(connections[topic], stamp, data)
    return path
