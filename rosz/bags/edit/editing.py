"""Bags made of bags: some of their messages, in another format, joined or divided."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from rosz.bags.bag import BagReader, BagWriter, Channel, Compression, Entry, Payload
from rosz.bags.formats.ros1_form import to_cdr, to_ros1
from rosz.bags.opening import create_writer, form_of
from rosz.errors import BagError, RoszError, UsageError
from rosz.typestore import TypeStore

Accept: TypeAlias = Callable[[Entry], bool]
"""Function that returns whether a message is taken."""

_Translate: TypeAlias = Callable[[Payload, int], bytes]


def merged(
    readers: Sequence[BagReader], report: Callable[[BagError], object], **chosen: Any
) -> Iterator[Entry]:
    """Yield the messages of bags, merged by time.

    Args:
        readers: The bags.
        report: Function called with each damaged part, which is left out.
        chosen: Topics, start and end, as `BagReader.messages` takes them.
    """
    parts = [reader.messages(**chosen, damaged=report) for reader in readers]
    return heapq.merge(*parts, key=lambda entry: entry.stamp)


class Transfer:
    """Writes messages of bags into another bag, in the form that its format has.

    Bags of ROS 1 hold ROS 1's layout, all others CDR. Channels that cannot have that form are left
    out.

    Args:
        writer: The bag that is written.
        types: Types for channels without a definition.
        report: Function called with a sentence for each channel that is left out.

    Attributes:
        count: Number of messages that were written.
    """

    def __init__(
        self, writer: BagWriter, types: TypeStore, report: Callable[[str], object]
    ) -> None:
        self._writer = writer
        self._types = types
        self._report = report
        self._channels: dict[int, tuple[Channel, int, _Translate] | None] = {}
        self.count: int = 0

    def write(self, entry: Entry) -> None:
        """Write a message.

        Raises:
            BagError: The file cannot be written.
            MessageError: The payload is not a message of its type.
        """
        key = id(entry.channel)
        if key not in self._channels:
            self._channels[key] = self._add(entry.channel)
        route = self._channels[key]
        if route is not None:
            _, handle, translate = route
            data = translate(entry.data, entry.sequence)
            self._writer.write(handle, entry.stamp, data, entry.sent, entry.sequence)
            self.count += 1

    def _add(self, channel: Channel) -> tuple[Channel, int, _Translate] | None:
        try:
            form, translate = self._form(channel)
            return channel, self._writer.add(form), translate
        except RoszError as error:
            self._report(f"topic '{channel.topic}' is left out: {error}")
            return None

    def _form(self, channel: Channel) -> tuple[Channel, _Translate]:
        if self._writer.format == "rosbag":
            return to_ros1(channel, self._types)
        form, translate = to_cdr(channel, self._types)
        return form, lambda data, _: translate(data)


def divide(
    entries: Iterable[Entry],
    path: str,
    types: TypeStore,
    report: Callable[[str], object],
    *,
    seconds: float = 0.0,
    size: int = 0,
    compression: Compression = "none",
) -> Iterator[tuple[Path, int]]:
    """Write messages into several bags; yield each with the number of messages in it.

    Args:
        entries: The messages.
        path: Path that the names are made of: ``x.mcap`` gives ``x_0.mcap`` and so on, and ``x/``
            the folders ``x_0`` and so on.
        types: Types for channels without a definition.
        report: Function called with a sentence for each channel that is left out.
        seconds: Longest time of a bag; 0 for no limit.
        size: Largest size of the messages in a bag in bytes; 0 for no limit.
        compression: Compression of the bags.

    Raises:
        BagError: A file exists, or cannot be written.
        UsageError: No limit is given, or the suffix is not known.
    """
    if not (seconds or size):
        raise UsageError("no limit is given: --duration SECONDS or --size MB")
    form = form_of(path)
    whole = Path(path)
    rest = iter(entries)
    entry = next(rest, None)
    number = 0
    while entry is not None:
        suffix = "" if form == "rosbag2" else whole.suffix
        file = whole.with_name(f"{whole.name.removesuffix(suffix)}_{number}{suffix}")
        end = entry.stamp + int(seconds * 1_000_000_000) if seconds else None
        taken = 0
        with create_writer(file, compression=compression, form=form) as writer:
            transfer = Transfer(writer, types, report)
            while entry is not None and (end is None or entry.stamp < end):
                if size and taken and taken + len(entry.data) > size:
                    break
                transfer.write(entry)
                taken += len(entry.data)
                entry = next(rest, None)
        yield file, transfer.count
        number += 1
