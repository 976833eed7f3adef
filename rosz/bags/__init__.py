"""Bags: recorded messages in files, in MCAP and in ROS 1's own format.

`open` gives a program a bag with messages::

    with rosz.bags.open("run.mcap") as bag:
        for entry in bag.messages("/scan"):
            print(entry.stamp, entry.message.ranges[0])

`BagReader` and `BagWriter` are what every format offers, with encoded messages. The package may
import nodes, and what stands below them; the libraries of the extra ``rosz[bag]`` are imported
where they are used. The names are imported on first use, and commands import its public modules
alone, since they have to start fast.
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from typing import Any

    from rosz.bags.bag import (
        Attachment,
        BagReader,
        BagWriter,
        Channel,
        Chunk,
        Compression,
        DamageReport,
        Entry,
        Payload,
    )
    from rosz.bags.mcap_reader import McapReader
    from rosz.bags.mcap_writer import McapWriter
    from rosz.bags.messages import Bag, BagMessage, BagOutput, class_of, decoder_of
    from rosz.bags.opening import (
        FORMATS,
        create_file,
        create_writer,
        find_format,
        form_of,
        open,  # noqa: A004
        open_reader,
    )
    from rosz.bags.qos_text import format_profiles, parse_profiles
    from rosz.bags.rosbag2_reader import STORAGES, Storage

PUBLIC_MODULES = (
    "editing",
    "images",
    "opening",
    "parameters",
    "player",
    "plotting",
    "recorder",
    "recording",
    "repair",
    "ros1_form",
    "ros1_reader",
    "summary",
    "tables",
    "writing",
)

__all__ = (
    "FORMATS",
    "STORAGES",
    "Attachment",
    "Bag",
    "BagMessage",
    "BagOutput",
    "BagReader",
    "BagWriter",
    "Channel",
    "Chunk",
    "Compression",
    "DamageReport",
    "Entry",
    "McapReader",
    "McapWriter",
    "Payload",
    "Storage",
    "class_of",
    "create_file",
    "create_writer",
    "decoder_of",
    "find_format",
    "form_of",
    "format_profiles",
    "open",
    "open_reader",
    "parse_profiles",
)

_HOMES = {
    "Attachment": "bag",
    "Bag": "messages",
    "BagMessage": "messages",
    "BagOutput": "messages",
    "BagReader": "bag",
    "BagWriter": "bag",
    "Channel": "bag",
    "Chunk": "bag",
    "Compression": "bag",
    "DamageReport": "bag",
    "Entry": "bag",
    "McapReader": "mcap_reader",
    "McapWriter": "mcap_writer",
    "Payload": "bag",
    "STORAGES": "rosbag2_reader",
    "Storage": "rosbag2_reader",
    "class_of": "messages",
    "decoder_of": "messages",
    "format_profiles": "qos_text",
    "parse_profiles": "qos_text",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'rosz.bags' has no attribute '{name}'")
    from importlib import import_module

    home = _HOMES.get(name, "opening")
    return getattr(import_module(f"rosz.bags.{home}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__} - {"TYPE_CHECKING", "annotations"})
