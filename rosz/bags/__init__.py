"""Bags: recorded messages in files, in MCAP and in ROS 1's own format.

`BagReader` and `BagWriter` are what every format offers, with encoded messages. It may import
nodes, and what stands below them; the libraries of the extra ``rosz[bag]`` are imported where they
are used.
"""

from rosz.bags.bag import (
    Attachment,
    BagReader,
    BagWriter,
    Channel,
    Chunk,
    Compression,
    DamageReport,
    Encoding,
    Entry,
    Payload,
)

__all__ = (
    "Attachment",
    "BagReader",
    "BagWriter",
    "Channel",
    "Chunk",
    "Compression",
    "DamageReport",
    "Encoding",
    "Entry",
    "Payload",
)
