"""Bags of rosbag2: folders of files of MCAP or SQLite."""

from __future__ import annotations

import time
from argparse import Namespace
from pathlib import Path
from typing import Any

from rosz.cli.call import Call
from rosz.cli.console import print_lines

_SECOND = 1_000_000_000
_UNITS = ("B", "KiB", "MiB", "GiB", "TiB")
_KIBI = 1024
_EVENTS = "/_service_event"


def record(given: Namespace) -> int | str:
    """Record topics."""
    from rosz.bags.formats import write_metadata
    from rosz.cli.bag.record import RecordLine, record_command

    topics = [*given.topics, *given.topics_positional]
    everything = given.all or given.all_topics
    if not (topics or everything or given.all_services or given.regex):
        return (
            "[ERROR] [ros2bag]: Need to specify at least one option out of --all, --all-topics,"
            " --all-services, --services, --topics, --topic-types or --regex"
        )
    folder = Path(given.output or time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S"))
    if folder.is_dir():
        return f"[ERROR] [ros2bag]: Output folder '{folder}' already exists."
    split = bool(given.max_bag_size or given.max_bag_duration)
    folder.mkdir(parents=True)
    line = RecordLine(
        topics=[f".*(?:{given.regex}).*"] if given.regex and not everything else topics,
        every=everything,
        regex=bool(given.regex) and not everything,
        exclude=_left_out(given),
        services=given.all or given.all_services,
        name=str(folder / f"{folder.name}{'' if split else '_0'}.mcap"),
        split=split,
        size=-(-given.max_bag_size >> 20),
        duration=str(given.max_bag_duration or ""),
        buffsize=-(-given.max_cache_size >> 20),
        zstd=given.compression_mode != "none",
    )
    try:
        return record_command(Call(), line)
    finally:
        if any(folder.iterdir()):
            write_metadata(folder)
        else:
            folder.rmdir()


def _left_out(given: Namespace) -> str:
    """Return an expression of the topics that are not recorded."""
    patterns = [given.exclude_regex, *given.exclude_topics]
    if (given.all or given.all_topics or given.regex) and not given.hidden:
        patterns.append(f"(?!.*{_EVENTS}$).*/_.*")
    return "|".join(filter(None, patterns))


def play(given: Namespace) -> int:
    """Play a bag."""
    from rosz.cli.bag.play import PlayLine, play_command

    clock = {"clock": True, "hz": given.clock} if given.clock else {}
    line = PlayLine(
        bags=[given.bag_path],
        rate=given.rate,
        topics=given.topics or None,
        loop=given.loop,
        delay=given.delay or 0.0,
        start=given.start_offset or 0.0,
        duration=given.playback_duration if (given.playback_duration or -1) >= 0 else None,
        pause=given.start_paused,
        **clock,
    )
    return play_command(Call(), line)


def info(given: Namespace) -> int:
    """Describe a bag."""
    from rosz.bags import open_reader

    with open_reader(given.bag_path) as reader:
        rows: dict[str, tuple[str, int, str]] = {}
        for channel in reader.channels:
            number = rows.get(channel.topic, ("", 0, ""))[1] + reader.count(channel)
            rows[channel.topic] = channel.type, number, channel.encoding
        keys: dict[str, Any] = {"name": lambda row: row[0], "type": lambda row: row[1][0]}
        order = keys.get(given.sort, lambda row: row[1][1])
        topics = sorted(((n, r) for n, r in rows.items() if not n.endswith(_EVENTS)), key=order)
        services = sorted(((n, r) for n, r in rows.items() if n.endswith(_EVENTS)), key=order)
        if given.topic_name and not given.verbose:
            print_lines(name for name, _ in topics)
            return 0
        lines = _head(Path(given.bag_path), reader, sum(row[1] for _, row in topics))
    shown = [
        f"Topic: {name} | Type: {kind} | Count: {count} | Serialization Format: {form}"
        for name, (kind, count, form) in topics
    ]
    lines += _column("Topic information: ", shown)
    lines.append(f"Service:           {len(services)}")
    shown = [
        f"Service: {name.removesuffix(_EVENTS)} | Type: {kind.removesuffix('_Event')} | Event"
        f" Count: {count} | Serialization Format: {form}"
        for name, (kind, count, form) in services
    ]
    print_lines([*lines, *_column("Service information: ", shown)])
    return 0


def _head(path: Path, reader: Any, messages: int) -> list[str]:
    files = [path]
    if path.is_dir():
        files = sorted(each for each in path.iterdir() if each.suffix in {".mcap", ".db3"})
    storage = "sqlite3" if files and files[0].suffix == ".db3" else "mcap"
    lines = ["", *_column("Files:             ", [each.name for each in files])]
    return [
        *lines,
        f"Bag size:          {_size(reader.size)}",
        f"Storage id:        {storage}",
        f"ROS Distro:        {_distribution(path)}",
        f"Duration:          {_seconds(reader.end - reader.start)}s",
        f"Start:             {_moment(reader.start)}",
        f"End:               {_moment(reader.end)}",
        f"Messages:          {messages}",
    ]


def _distribution(path: Path) -> str:
    import yaml

    file = path / "metadata.yaml"
    tree = yaml.safe_load(file.read_text("utf-8")) if file.is_file() else {}
    return str(tree.get("rosbag2_bagfile_information", {}).get("ros_distro") or "unknown")


def _column(title: str, rows: list[str]) -> list[str]:
    first, *others = rows or [""]
    return [title + first, *(" " * len(title) + row for row in others)]


def _size(number: float) -> str:
    unit = 0
    while number >= _KIBI and unit < len(_UNITS) - 1:
        number /= _KIBI
        unit += 1
    return f"{number:.{min(unit, 1)}f} {_UNITS[unit]}"


def _seconds(nanoseconds: int) -> str:
    return f"{nanoseconds // _SECOND}.{nanoseconds % _SECOND:09d}"


def _moment(stamp: int) -> str:
    local = time.localtime(stamp // _SECOND)
    day = time.strftime("%b %e %Y %H:%M:%S", local)
    return f"{day}.{stamp % _SECOND:09d} ({_seconds(stamp)})"
