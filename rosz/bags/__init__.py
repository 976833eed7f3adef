"""Bags: recorded messages in files, in MCAP and in ROS 1's own format.

`open` gives a program a bag with messages::

    with rosz.bags.open("run.mcap") as bag:
        for entry in bag.messages("/scan"):
            print(entry.stamp, entry.message.ranges[0])

`BagReader` and `BagWriter` are what every format offers, with encoded messages. The package may
import nodes, and what stands below them; the libraries of the extra ``rosz[bag]`` are imported
where they are used. Commands import its public modules alone, since they have to start fast.
"""

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
