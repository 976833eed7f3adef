"""Copying bags: to recover readable messages, to give them an index, to compress them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

import msgspec

from rosz.bags.bag import BagReader, BagWriter, Channel, Compression, Entry, FileErrors
from rosz.bags.formats.rosbag2_reader import Rosbag2Reader, SqliteReader
from rosz.bags.formats.writing import refuse_written, removed_unfinished
from rosz.bags.messages import class_of
from rosz.bags.opening import ACTIVE, create_writer, open_reader
from rosz.errors import BagError, RoszError
from rosz.typestore import TypeStore


class Copied(msgspec.Struct):
    """The result of copying a bag.

    Attributes:
        path: The new bag.
        backup: Where the old one is, if it had the same name.
        count: Number of messages in the new one.
        problems: The damaged parts, which are left out.
    """

    path: Path
    backup: Path | None
    count: int
    problems: list[BagError]


class TypeDifference(msgspec.Struct, frozen=True):
    """A type that has another definition here than in a bag.

    Attributes:
        type: ``pkg/msg/Name``.
        reason: The difference.
    """

    type: str
    reason: str


def copy_bag(reader: BagReader, writer: BagWriter, problems: list[BagError] | None = None) -> int:
    """Write all of a bag into another one of the same encoding; return the number of messages.

    Damaged parts are added to the problems; the first one is raised when these are not given.
    """
    handles = {channel: writer.add(channel) for channel in reader.channels}
    for name, texts in reader.metadata.items():
        writer.add_metadata(name, texts)
    for attachment in reader.attachments():
        writer.add_attachment(attachment)
    count = 0
    entry: Entry
    for entry in reader.messages(damaged=None if problems is None else problems.append):
        handle = handles[entry.channel]
        writer.write(handle, entry.stamp, entry.data, entry.sent, entry.sequence)
        count += 1
    return count


def recover(
    path: Path,
    target: str | os.PathLike[str],
    *,
    compression: Compression = "none",
    like: bool = False,
) -> Copied:
    """Write the readable parts of a bag into a new one.

    Args:
        path: The bag, which may be damaged or have no index.
        target: The new bag, whose path tells its format; must not exist.
        compression: Compression of the new bag.
        like: Whether the new bag has the format of the old one, whatever its path.

    Raises:
        BagError: The bag cannot be read at all, or the new one cannot be written.
        UsageError: The format of the new bag has no such compression.
    """
    with open_reader(path) as reader:
        problems = list(reader.problems)
        storage = reader.storage if isinstance(reader, Rosbag2Reader) else "mcap"
        form = reader.format if like else ""
        with create_writer(target, compression=compression, form=form, storage=storage) as writer:
            count = copy_bag(reader, writer, problems)
        unfinished = not reader.indexed and (reader.problems or reader.format == "rosbag")
        if unfinished and not count:
            reason = "it holds no message: its recorder was killed before it had written one"
            problems.append(BagError(reason, str(path)))
    return Copied(Path(target), None, count, problems)


def rewrite(
    path: Path, compression: Compression | None, *, folder: Path | None = None, force: bool = False
) -> Copied:
    """Replace a bag by a copy, and keep the old one as ``NAME.orig.SUFFIX``, as rosbag does.

    The copy takes its place when it is complete. ``NAME.SUFFIX.active`` stays as it is, and the
    copy is ``NAME.SUFFIX``.

    Args:
        path: The bag.
        compression: Compression of the copy; that of the bag when not given.
        folder: Folder of the copy, where it has the name of the bag; the bag then stays as it is.
        force: Whether an older backup is replaced.

    Raises:
        BagError: There is a backup already, the bag is being recorded or cannot be read at all, or
            the copy cannot be written.
        UsageError: The format has no such compression.
    """
    name = path.name.removesuffix(ACTIVE)
    target = (folder or path.parent) / name
    in_place = target.absolute() == path.absolute()
    backup = path.with_name(f"{path.stem}.orig{path.suffix}") if in_place else None
    if backup is not None and backup.exists() and not force:
        raise BagError(f"the backup '{backup}' exists already; -f replaces it", str(path))
    if backup is None and target.exists():
        raise BagError(f"'{target}' exists already", str(path))
    refuse_written(str(path))
    with open_reader(path) as reader:
        wanted = _compression_of(reader) if compression is None else compression
        if isinstance(reader, SqliteReader):
            raise BagError("it is one file of a bag of rosbag2; give the folder", str(path))
    holder = target.with_name(f".{name}.part{os.getpid()}")
    with FileErrors(holder, "cannot create it"):
        holder.mkdir()
    with removed_unfinished(holder, target):
        made = holder / name
        copied = recover(path, made, compression=wanted, like=True)
        if backup is not None:
            if backup.is_dir():
                shutil.rmtree(backup)
            path.replace(backup)
        made.replace(target)
        holder.rmdir()
    return msgspec.structs.replace(copied, path=target, backup=backup)


def _compression_of(reader: BagReader) -> Compression:
    if isinstance(reader, Rosbag2Reader):
        return reader.compression
    compressions: list[Compression] = [chunk.compression for chunk in reader.chunks]
    return max(compressions, key=compressions.count) if compressions else "none"


def check_bag(reader: BagReader) -> tuple[int, list[BagError]]:
    """Read a whole bag, and return the number of readable messages, and the damaged parts."""
    problems = list(reader.problems)
    count = sum(1 for _ in reader.messages(damaged=problems.append))
    return count, problems


def find_differences(channels: Sequence[Channel], types: TypeStore) -> list[TypeDifference]:
    """Return the types that have another definition here than in a bag.

    Args:
        channels: Channels of the bag.
        types: The types that are known here.
    """
    differences: dict[str, TypeDifference] = {}
    for channel in channels:
        reason = _difference(channel, types)
        if reason:
            differences.setdefault(channel.type, TypeDifference(channel.type, reason))
    return sorted(differences.values(), key=lambda difference: difference.type)


def _difference(channel: Channel, types: TypeStore) -> str:
    try:
        recorded = class_of(channel, types)
    except RoszError as error:
        return f"the definition in the bag cannot be used: {error}"
    try:
        local = types.message(channel.type)
    except RoszError:
        return ""  # the definition in the bag serves
    if local is recorded or local._md5sum == recorded._md5sum:
        return ""
    return f"its hash is {recorded._md5sum} in the bag, and {local._md5sum} here"
