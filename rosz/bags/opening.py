"""Opening bags: the format of a file that is read is told by its first bytes.

The module of a format is imported with the first bag of it, since a recorder needs only one.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Literal, overload

from rosz.bags.bag import BagReader, BagWriter, Compression, FileErrors
from rosz.bags.formats.mcap_records import MAGIC
from rosz.errors import BagError, UsageError

if TYPE_CHECKING:
    from rosz.bags.formats.chunk_writer import ChunkWriter
    from rosz.bags.formats.rosbag2_reader import Storage
    from rosz.bags.messages import Bag, BagOutput
    from rosz.typestore import TypeStore

_MOST_MAGIC = 16
_SQLITE = b"SQLite format 3"
_SUFFIXES = {".mcap": "mcap", ".bag": "rosbag"}

FORMATS = ("mcap", "rosbag", "rosbag2")
"""The names of the formats."""

ACTIVE = ".active"
"""Suffix of a bag that is being recorded, or was when its recorder was killed."""


def find_format(path: str | os.PathLike[str]) -> str:
    """Return the format of a bag: ``mcap``, ``rosbag`` (ROS 1) or ``rosbag2``.

    Raises:
        BagError: The file cannot be read, or is not a bag.
    """
    if Path(path).is_dir():
        return "rosbag2"
    with FileErrors(path, "cannot open it"), Path(path).open("rb") as file:
        magic = file.read(_MOST_MAGIC)
    if magic.startswith(MAGIC):
        return "mcap"
    if magic.startswith(b"#ROS"):
        return "rosbag"
    if magic.startswith(_SQLITE):
        return "rosbag2"
    if not magic:
        from rosz.bags.formats.ros1_records import describe_begin

        raise BagError(describe_begin(magic), str(path), 0)
    raise BagError(
        f"it is not a bag: it begins with {magic[:8]!r}, expected MCAP's {MAGIC!r}, '#ROSBAG V2.0'"
        f" or '{_SQLITE.decode()}'",
        str(path),
        0,
    )


def open_reader(path: str | os.PathLike[str]) -> BagReader:
    """Open a bag of any format.

    Raises:
        BagError: The file cannot be read, or is not a bag.
        UsageError: The library for its compression is not installed.
    """
    kind = find_format(path)
    if kind == "rosbag":
        from rosz.bags.formats.ros1_reader import Ros1Reader

        return Ros1Reader(path)
    if kind == "rosbag2":
        from rosz.bags.formats.rosbag2_reader import Rosbag2Reader, SqliteReader

        return Rosbag2Reader(path) if Path(path).is_dir() else SqliteReader(path)
    from rosz.bags.formats.mcap_reader import McapReader

    return McapReader(path)


def create_writer(
    path: str | os.PathLike[str],
    *,
    compression: Compression = "none",
    replace: bool = False,
    form: str = "",
    storage: Storage = "mcap",
) -> BagWriter:
    """Create a bag of any format.

    Args:
        path: Path that tells the format: ``NAME.mcap``, ``NAME.bag`` for a bag of ROS 1, or
            ``NAME/`` for a folder of rosbag2.
        compression: Name of the compression.
        replace: Whether a file that exists is replaced; otherwise it is an error, as is a folder.
        form: Format, as `find_format` names it; that of the path when not given.
        storage: Storage of rosbag2.

    Raises:
        BagError: The bag cannot be created.
        UsageError: The format is not known, or has no such compression.
    """
    kind = form or form_of(path)
    if kind == "rosbag2":
        from rosz.bags.formats.rosbag2_writer import Rosbag2Writer

        return Rosbag2Writer(path, storage=storage, compression=compression)
    if kind not in FORMATS:
        raise UsageError(f"format '{kind}' is not known; expected one of {', '.join(FORMATS)}")
    return _writer_of(kind)(path, compression=compression, replace=replace)


def _writer_of(kind: str) -> type[ChunkWriter]:
    """Return the class that writes a format of one file."""
    if kind == "rosbag":
        from rosz.bags.formats.ros1_writer import Ros1Writer

        return Ros1Writer
    from rosz.bags.formats.mcap_writer import McapWriter

    return McapWriter


def form_of(path: str | os.PathLike[str]) -> str:
    """Return the format that a path tells for a bag to write, as `find_format` names it.

    Raises:
        UsageError: It tells none.
    """
    text = str(path)
    if text.endswith(os.sep):
        return "rosbag2"
    suffix = Path(text.removesuffix(ACTIVE)).suffix
    if suffix not in _SUFFIXES:
        raise UsageError(
            f"'{text}' does not tell the format of the bag; expected a name.mcap, a name.bag, or a"
            " folder/ of rosbag2"
        )
    return _SUFFIXES[suffix]


def create_file(
    path: str | os.PathLike[str],
    *,
    compression: Compression = "none",
    replace: bool = False,
    chunk_size: int = 768 << 10,
    checksums: bool = True,
) -> ChunkWriter:
    """Create a bag that is a file; the suffix of the path tells the format.

    Args:
        path: Path that ends in ``.mcap``, or ``.bag`` for a bag of ROS 1; ``.active`` may follow.
        compression: Name of the compression.
        replace: Whether a file that exists is replaced; otherwise it is an error.
        chunk_size: Bytes of messages that are written, and compressed, together.
        checksums: Whether chunks have checksums, in a format that has them.

    Raises:
        BagError: The file cannot be created.
        UsageError: The suffix is not known, or the format has no such compression.
    """
    kind = form_of(path)
    if kind == "rosbag2":
        raise UsageError(f"'{path}' is a folder; expected a name.mcap or a name.bag")
    return _writer_of(kind)(
        path, compression=compression, replace=replace, chunk_size=chunk_size, checksums=checksums
    )


@overload
def open(  # noqa: A001
    path: str | os.PathLike[str], mode: Literal["r"] = "r", *, types: TypeStore | None = None
) -> Bag: ...


@overload
def open(  # noqa: A001
    path: str | os.PathLike[str], mode: Literal["w", "x"], *, compression: Compression = "none"
) -> BagOutput: ...


def open(  # noqa: A001
    path: str | os.PathLike[str],
    mode: Literal["r", "w", "x"] = "r",
    *,
    compression: Compression = "none",
    types: TypeStore | None = None,
) -> Bag | BagOutput:
    """Open a bag, as ``with rosz.bags.open("run.mcap") as bag:``.

    Args:
        path: Path of the bag. When it is written, its suffix tells the format.
        mode: ``r`` to read, ``w`` to write a new file or replace one, ``x`` to write a new one.
        compression: Compression of a bag that is written: ``none``, ``lz4``, ``zstd`` for MCAP, or
            ``bz2`` for a bag of ROS 1.
        types: Types for channels without a definition; those that come with rosz when not given.

    Raises:
        BagError: The file cannot be read or created, or is not a bag.
        UsageError: The suffix or the compression is not known.
    """
    from rosz.bags.messages import Bag, BagOutput

    if mode == "r":
        from rosz.typestore import TypeStore  # slow to import, and most bags hold their definitions

        return Bag(open_reader(path), types or TypeStore())
    writer = create_writer(path, compression=compression, replace=mode == "w")
    if writer.format != "rosbag":
        return BagOutput(writer, time.time_ns)
    from rosz.bags.formats.ros1_form import to_ros1
    from rosz.typestore import TypeStore

    store = types or TypeStore()
    return BagOutput(writer, time.time_ns, lambda channel: to_ros1(channel, store)[0])
