"""Summaries of bags, as text and as YAML, as ``rosbag info`` prints them."""

from __future__ import annotations

import math
import re
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from itertools import pairwise
from statistics import median

import msgspec

from rosz.bags.bag import BagReader
from rosz.bags.formats.ros1_reader import Ros1Reader
from rosz.names import short_type

_NS = 1_000_000_000
_PLAIN = re.compile(r"[/\w]([-\w/. +@=~]*[-\w/.+@=~])?")
_BINARY = 1024.0
_DECIMAL = 1000.0
_SIZES = ("KB", "MB", "GB", "TB", "PB", "EB", "ZB", "YB")
_FREQUENCIES = ("Hz", "kHz", "MHz", "GHz", "THz", "PHz", "EHz", "ZHz", "YHz")


class CompressionSummary(msgspec.Struct, frozen=True):
    """The chunks that are compressed in one way: their number, and their bytes."""

    name: str
    chunks: int
    size: int
    uncompressed: int


class TopicSummary(msgspec.Struct, frozen=True):
    """One topic: its type as ``pkg/Name``, and its numbers of messages and of channels.

    The frequency is in messages per second, by the median of the times between them; None if
    unknown.
    """

    topic: str
    type: str
    messages: int
    connections: int
    frequency: float | None = None


class Summary(msgspec.Struct, frozen=True):
    """A summary of a bag.

    Attributes:
        path: The bag.
        format: Name of its format.
        version: Version of the format.
        indexed: Whether it has an index.
        start: Seconds since the Unix epoch.
        end: The same, of the last message.
        duration: Seconds between both.
        size: Size in bytes.
        messages: Number of messages.
        compressions: The compressions of chunks, the most frequent one first.
        types: Hashes of the types in ROS 1 by name, sorted.
        topics: The topics, sorted.
    """

    path: str
    format: str
    version: str
    indexed: bool
    start: float
    end: float
    duration: float
    size: int
    messages: int
    compressions: list[CompressionSummary]
    types: dict[str, str]
    topics: list[TopicSummary]


def summarize(path: str, reader: BagReader, *, frequencies: bool = False) -> Summary:
    """Return the summary of a bag, by its index.

    Args:
        path: The bag, as it is to be shown.
        reader: The bag.
        frequencies: Whether to find how often messages came, which reads all their times.

    Raises:
        BagError: A part of the bag is damaged.
    """
    per_second = find_frequencies(reader) if frequencies else {}
    types: dict[str, str] = {}
    counts: Counter[str] = Counter()
    connections = Counter(channel.topic for channel in reader.channels)
    names: dict[str, str] = {}
    for channel in dict.fromkeys(reader.channels):
        types.setdefault(short_type(channel.type), channel.md5)
        names.setdefault(channel.topic, short_type(channel.type))
        counts[channel.topic] += reader.count(channel)
    start, end = _seconds(reader.start), _seconds(reader.end)
    return Summary(
        path=path,
        format=reader.format,
        version=reader.version,
        indexed=reader.indexed,
        start=start,
        end=end,
        duration=end - start,
        size=reader.size,
        messages=reader.count(),
        compressions=_compressions(reader),
        types=dict(sorted(types.items())),
        topics=[
            TopicSummary(
                topic, names[topic], counts[topic], connections[topic], per_second.get(topic)
            )
            for topic in sorted(names)
        ],
    )


def _seconds(stamp: int) -> float:
    return stamp // _NS + stamp % _NS / 1e9


def _compressions(reader: BagReader) -> list[CompressionSummary]:
    chunks: Counter[str] = Counter()
    sizes: Counter[str] = Counter()
    uncompressed: Counter[str] = Counter()
    for chunk in reader.chunks:
        chunks[chunk.compression] += 1
        sizes[chunk.compression] += chunk.size
        uncompressed[chunk.compression] += chunk.uncompressed
    order = sorted(chunks, key=lambda name: (chunks[name], name), reverse=True)
    return [
        CompressionSummary(name, chunks[name], sizes[name], uncompressed[name]) for name in order
    ]


def find_frequencies(reader: BagReader) -> dict[str, float]:
    """Return how often messages of each topic came, by the median of the times between them."""
    stamps: defaultdict[str, list[float]] = defaultdict(list)
    entries = ((entry.channel, entry.stamp) for entry in reader.messages())
    for channel, stamp in reader.stamps() if isinstance(reader, Ros1Reader) else entries:
        stamps[channel.topic].append(_seconds(stamp))
    frequencies = {}
    for topic, times in stamps.items():
        times.sort()
        period = median(second - first for first, second in pairwise(times)) if times[1:] else 0.0
        if period > 0:
            frequencies[topic] = 1 / period
    return frequencies


# As text.


def format_summary(summary: Summary) -> str:
    """Return the text of ``rosbag info``."""
    rows = [("path", summary.path), ("version", summary.version)]
    if summary.format != "rosbag":
        rows[1] = ("format", f"{summary.format} {summary.version}".rstrip())
    if not summary.messages:
        rows.append(("size", _size(summary.size)))
    else:
        rows += [
            ("duration", _duration(summary.duration)),
            ("start", f"{_date(summary.start)} ({summary.start:.2f})"),
            ("end", f"{_date(summary.end)} ({summary.end:.2f})"),
            ("size", _size(summary.size)),
            ("messages", str(summary.messages)),
            *_compression_rows(summary),
            *_type_rows(summary),
            *_topic_rows(summary),
        ]
    width = max(len(name) for name, _ in rows) + 1
    lines = [f"{f'{name}:' if name else '':<{width}} {text}" for name, text in rows]
    return "\n".join(lines).rstrip()


def _duration(seconds: float) -> str:
    minutes, hours = int(seconds / 60), int(seconds / 3600)
    if hours:
        return f"{hours}hr {minutes % 60}:{int(seconds % 60):02d}s ({int(seconds)}s)"
    if minutes:
        return f"{minutes}:{int(seconds % 60):02d}s ({int(seconds)}s)"
    return f"{seconds:.1f}s"


def _date(seconds: float) -> str:
    fraction = f"{seconds - int(seconds):.2f}"[1:]
    return time.strftime("%b %d %Y %H:%M:%S", time.localtime(seconds)) + fraction


def _size(size: float) -> str:
    return _scaled(size / _BINARY, _BINARY, _SIZES)


def _scaled(value: float, step: float, units: Sequence[str]) -> str:
    for unit in units:
        if value < step:
            return f"{value:.1f} {unit}"
        value /= step
    return "-"


def _compression_rows(summary: Summary) -> list[tuple[str, str]]:
    total = sum(compression.chunks for compression in summary.compressions)
    texts = []
    for compression in summary.compressions:
        percent = (
            ""
            if compression.name == "none"
            else f"; {100 * compression.size / max(compression.uncompressed, 1):.2f}%"
        )
        texts.append(f"{compression.name} [{compression.chunks}/{total} chunks{percent}]")
    rows = [("compression", ", ".join(texts) or "none")]
    if all(compression.name == "none" for compression in summary.compressions):
        return rows
    before, after = sizes = _sizes(summary)
    width = max(len(_size(size)) for size in sizes)
    texts = [f"{_size(size):>{width}}" for size in sizes]
    if summary.duration > 0:
        rates = [_size(size / summary.duration) for size in sizes]
        wide = max(map(len, rates))
        texts = [f"{text} @ {rate:>{wide}}/s" for text, rate in zip(texts, rates, strict=True)]
        texts[1] += f" ({100 * after / max(before, 1):.2f}%)"
    return [*rows, *zip(("uncompressed", "compressed"), texts, strict=True)]


def _sizes(summary: Summary) -> tuple[int, int]:
    """Return the bytes of all chunks without compression, and in the file."""
    chunks = summary.compressions
    return sum(each.uncompressed for each in chunks), sum(each.size for each in chunks)


def _type_rows(summary: Summary) -> list[tuple[str, str]]:
    width = max(map(len, summary.types))
    texts = [f"{name:<{width}} [{md5}]" for name, md5 in summary.types.items()]
    return [("" if number else "types", text) for number, text in enumerate(texts)]


def _topic_rows(summary: Summary) -> list[tuple[str, str]]:
    topics = summary.topics
    widest = max(len(topic.topic) for topic in topics)
    digits = max(len(str(topic.messages)) for topic in topics)
    type_width = max(map(len, summary.types))
    shown = {
        topic.topic: _scaled(topic.frequency, _DECIMAL, _FREQUENCIES)
        for topic in topics
        if topic.frequency is not None
    }
    wide = max(map(len, shown.values()), default=0)
    rows = []
    for number, topic in enumerate(topics):
        word = "msgs" if topic.messages > 1 else "msg "
        mark = "@" if topic.topic in shown else " "
        rate = f" {mark} {shown.get(topic.topic, ''):>{wide}}"
        more = f" ({topic.connections} connections)" if topic.connections > 1 else ""
        text = f"{topic.topic:<{widest}}   {topic.messages:>{digits}} {word}{rate}"
        rows.append(("" if number else "topics", f"{text} : {topic.type:<{type_width}}{more}"))
    return rows


# As YAML.


def format_yaml(summary: Summary) -> str:
    """Return the text of ``rosbag info --yaml``."""
    lines = [f"path: {_scalar(summary.path)}", f"version: {summary.version}"]
    if not summary.messages:
        return "\n".join([*lines, f"size: {summary.size}", "indexed: False", ""])
    lines += [
        f"duration: {summary.duration:.6f}",
        f"start: {summary.start:.6f}",
        f"end: {summary.end:.6f}",
        f"size: {summary.size}",
        f"messages: {summary.messages}",
        f"indexed: {summary.indexed}",
        f"compression: {summary.compressions[0].name if summary.compressions else 'none'}",
    ]
    if any(compression.name != "none" for compression in summary.compressions):
        before, after = _sizes(summary)
        lines += [f"uncompressed: {before}", f"compressed: {after}"]
    lines.append("types:")
    for name, md5 in summary.types.items():
        lines += [f"    - type: {_scalar(name)}", f"      md5: {md5}"]
    lines.append("topics:")
    for topic in summary.topics:
        lines += [
            f"    - topic: {_scalar(topic.topic)}",
            f"      type: {_scalar(topic.type)}",
            f"      messages: {topic.messages}",
        ]
        if topic.connections > 1:
            lines.append(f"      connections: {topic.connections}")
        if topic.frequency is not None:
            lines.append(f"      frequency: {topic.frequency:.4f}")
    return "\n".join([*lines, ""])


def _scalar(text: str) -> str:
    """Return a name as YAML: as it is if it can only mean that, else in quotes."""
    if _PLAIN.fullmatch(text):
        return text
    import yaml  # slow to load, and rarely needed

    quoted: str = yaml.dump(text, default_style='"', width=math.inf)
    return quoted.rstrip("\n")
