"""Bags: recorded messages in files, in MCAP and in ROS 1's own format.

`open` gives a program a bag with messages::

    with rosz.bags.open("run.mcap") as bag:
        for entry in bag.messages("/scan"):
            print(entry.stamp, entry.message.ranges[0])

`BagReader` and `BagWriter` are what every format offers, with encoded messages. The package may
import nodes, and what stands below them; the libraries of the extra ``rosz[bag]`` are imported
where they are used. ``edit``, ``export``, ``formats``, ``play`` and ``record`` export what works
on bags. The names are imported on first use, since commands have to start fast.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
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
    from rosz.bags.formats.mcap_reader import McapReader
    from rosz.bags.formats.mcap_writer import McapWriter
    from rosz.bags.formats.rosbag2_reader import STORAGES, Storage
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
    from rosz.bags.summary import Summary, format_summary, format_yaml, summarize
else:
    __getattr__ = exports_of(__name__)

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
    "Summary",
    "class_of",
    "create_file",
    "create_writer",
    "decoder_of",
    "find_format",
    "form_of",
    "format_summary",
    "format_yaml",
    "open",
    "open_reader",
    "summarize",
)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__} - {"TYPE_CHECKING", "annotations", "exports_of"})
