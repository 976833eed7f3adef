"""``rosz bag cat``, ``export`` and ``plot``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from msgspec import Struct
from msgspec.structs import replace

from rosz import names
from rosz.cli.bag.play import list_topics
from rosz.cli.bag.source import (
    BagArgument,
    BagInput,
    End,
    Part,
    Start,
    app,
    check_times,
    open_bags,
)
from rosz.cli.call import Call
from rosz.cli.console import count, print_lines, warn
from rosz.cli.declare import Argument, Json, Option, at_least
from rosz.errors import MessageError, NotFoundError, UsageError

if TYPE_CHECKING:
    from rosz.bags import BagReader, Channel, Entry, Payload
    from rosz.introspect import Echo, EchoOptions
    from rosz.typestore import TypeStore

_FORMATS = ("csv", "json", "parquet", "png", "jpg", "mp4")
_FASTEST = 1000.0


class CatForm(Struct, frozen=True, kw_only=True):
    """The options for the text of each message."""

    plot: Annotated[bool, Option("-p", "Print comma-separated numbers, for plotting.")] = False
    condition: Annotated[
        str, Option("--filter EXPRESSION", "Use only messages for which this is true.")
    ] = ""
    nostr: Annotated[bool, Option("--nostr", "Leave strings out.")] = False
    noarr: Annotated[bool, Option("--noarr", "Leave arrays out.")] = False


@app.command("cat", arrange=list_topics)
def cat_command(
    call: Call,
    bag: BagArgument,
    topic: Annotated[str, Argument("TOPIC_OR_FIELD", "All topics if omitted.")] = "",
    *,
    limit: Annotated[int | None, Option("-n COUNT", "Stop after this number of messages.")] = None,
    form: CatForm,
    start: Start = 0.0,
    end: End = None,
    json: Json = False,
) -> int:
    """Print the messages of a bag, as topic echo prints them."""
    from rosz.introspect import EchoOptions, Filter

    check_times(start, end)
    at_least("-n", limit, 1, "messages")
    options = EchoOptions(
        plot=form.plot,
        as_json=json,
        no_arrays=form.noarr,
        no_strings=form.nostr,
        condition=Filter(form.condition) if form.condition else None,
    )
    with open_bags([bag]) as source:
        echoes = _Echoes(source.readers[0], topic, options, call)
        entries = source.entries(Part(topics=echoes.topics, start=start, end=end))
        for text in islice(filter(None, map(echoes.text, entries)), limit):
            sys.stdout.write(text)
    return int(bool(source.problems))


@app.command("export", arrange=list_topics)
def export_command(
    call: Call,
    bag: BagArgument,
    folder: Annotated[str, Argument("DIR", "The folder of the files; made if it is missing.")],
    *,
    form: Annotated[
        str,
        Option(
            "--format NAME",
            "csv, json or parquet for all fields; png, jpg or mp4 for topics with images.",
        ),
    ] = "csv",
    json: Annotated[bool, Option("--json", "The same as --format json.")] = False,
    fps: Annotated[
        float | None, Option("--fps RATE", "Frames per second of mp4; as recorded if omitted.")
    ] = None,
    force: Annotated[bool, Option("-f --force", "Replace files that exist.")] = False,
    part: Part,
) -> int:
    """Write each topic of a bag into a file: a table, pictures, or a video.

    Tables have one row per message, behind the time in nanoseconds. In CSV, sequences are JSON in
    one column, and octets are left out.
    """
    check_times(part.start, part.end)
    form = "json" if json else form
    if form not in _FORMATS:
        raise UsageError(f"--format is '{form}'; expected {', '.join(_FORMATS)}")
    if fps is not None and form != "mp4":
        raise UsageError("--fps is for videos: give --format mp4 too")
    if fps is not None and not 0 < fps <= _FASTEST:
        raise UsageError(f"--fps is {fps:g}; expected more than 0, and at most {_FASTEST:g}")
    with open_bags([bag]) as source:
        export = _Export(source, part, Path(folder), call.types, replace=force)
        export.entries()  # a topic that is not there is an error before any file is made
        if form in {"csv", "json", "parquet"}:
            print_lines(_export_tables(export, form))
        elif form == "mp4":
            print_lines(_export_videos(export, fps))
        else:
            print_lines(_export_pictures(export, form))
    return int(bool(source.problems))


class _Export:
    """The messages of a bag that options choose, and the folder for their files."""

    def __init__(
        self, source: BagInput, part: Part, folder: Path, types: TypeStore, *, replace: bool
    ) -> None:
        from rosz.bags import Bag

        self.reader = source.readers[0]
        self.types = types
        self.folder = folder
        self.replace = replace
        self.decoder = Bag(self.reader, types).decoder
        self._source = source
        self._part = part

    def entries(self) -> Iterator[Entry]:
        """Return the messages, from the first one on."""
        return self._source.entries(self._part)

    def choose_images(self) -> dict[str, Path]:
        """Choose the topics with images if none are given; return the paths of their files."""
        from rosz.bags.export import IMAGE_TYPES, file_names

        types = {channel.topic: channel.type for channel in self.reader.channels}
        channels = (channel for channel in self.reader.channels if channel.type in IMAGE_TYPES)
        images = [*dict.fromkeys(channel.topic for channel in channels)]
        topics = [names.join("/", topic) for topic in self._part.topics or images]
        for name in topics:
            if name in types and name not in images:
                raise UsageError(f"topic '{name}' has no images, but {types[name]}")
        if not topics:
            raise NotFoundError("the bag has no topic with images: no Image, no CompressedImage")
        self._part = replace(self._part, topics=topics)
        files = file_names(images)
        return {topic: self.folder / files[topic] for topic in images if topic in topics}

    @contextmanager
    def left_out_if_damaged(self, entry: Entry) -> Iterator[None]:
        """Report a message that is not well-formed, and go on."""
        try:
            yield
        except MessageError as error:
            place = f"message of '{entry.channel.topic}' at {entry.stamp / 1e9:.9f}"
            self._source.report(f"{place} is left out: {error}")


def _export_tables(export: _Export, form: str) -> list[str]:
    from rosz.bags.export import Tables

    channels = export.reader.channels
    with Tables(export.folder, form, channels, export.types, replace=export.replace) as tables:
        for entry in export.entries():
            with export.left_out_if_damaged(entry):
                tables.write(entry)
    return [f"{file}: {count(rows, 'row')}" for file, rows in sorted(tables.rows.items())]


def _export_pictures(export: _Export, form: str) -> list[str]:
    _check_vision()
    from rosz.bags.export import ImageFiles

    folders = export.choose_images()
    files: dict[str, ImageFiles] = {}
    for entry in export.entries():
        topic = entry.channel.topic
        if topic not in files:
            files[topic] = ImageFiles(folders[topic], form, replace=export.replace)
        with export.left_out_if_damaged(entry):
            files[topic].write(export.decoder(entry.channel)(entry.data), entry.stamp)
    return [
        f"{folders[topic]}: {count(pictures.count, 'picture')}"
        for topic, pictures in sorted(files.items())
    ]


def _export_videos(export: _Export, rate: float | None) -> list[str]:
    _check_vision()
    from rosz.bags.export import Video, VideoTimes

    files = {
        topic: path.with_name(f"{path.name}.mp4") for topic, path in export.choose_images().items()
    }
    times: dict[str, VideoTimes] = {}
    for entry in export.entries():
        with export.left_out_if_damaged(entry):
            message = export.decoder(entry.channel)(entry.data)
            times.setdefault(entry.channel.topic, VideoTimes()).add(message, entry.stamp)
    videos: dict[str, Video] = {}
    with ExitStack() as stack:
        for topic, frames in times.items():
            video = Video(files[topic], frames, rate, replace=export.replace)
            videos[topic] = stack.enter_context(closing(video))
        for entry in export.entries():
            with export.left_out_if_damaged(entry):
                videos[entry.channel.topic].write(export.decoder(entry.channel)(entry.data))
    return [
        f"{files[topic]}: {count(video.count, 'frame')} at {video.rate:g} per"
        f" second, {video.repeated} repeated, {video.dropped} left out"
        for topic, video in sorted(videos.items())
    ]


def _check_vision() -> None:
    try:
        import cv2  # noqa: F401
        import numpy  # noqa: F401, ICN001
    except ImportError as error:
        raise UsageError("images need OpenCV: pip install 'rosz[vision]'") from error


@app.command("plot")
def plot_command(
    call: Call,
    bag: BagArgument,
    fields: Annotated[
        list[str],
        Argument("FIELD", "An axis each: /pose/x, /pose/x:y, /scan/ranges[0], or some by commas."),
    ],
    *,
    output: Annotated[str, Option("-o --output FILE", "NAME.png, NAME.svg or NAME.pdf.")],
    title: Annotated[
        str, Option("--title TEXT", "Text above; the name of the bag if omitted.")
    ] = "",
    start: Start = 0.0,
    end: End = None,
) -> int:
    """Draw numbers of a bag over time into a picture."""
    from rosz.bags import Bag, class_of
    from rosz.bags.export import check_format, draw, find_curves, read_curves

    check_times(start, end)
    check_format(Path(output))
    with open_bags([bag]) as source:
        reader = source.readers[0]
        by_type = {channel.type: channel for channel in reader.channels}
        types = {channel.topic: [channel.type] for channel in reader.channels}
        axes = find_curves(fields, types, lambda each: class_of(by_type[each], call.types))
        topics = [*dict.fromkeys(curve.topic for axis in axes for curve in axis)]
        entries = source.entries(Part(topics=topics, start=start, end=end))
        read_curves(axes, entries, Bag(reader, call.types).decoder, reader.start)
        for curve in (curve for axis in axes for curve in axis):
            if curve.missing:
                warn(f"{count(curve.missing, 'message')} have no '{curve.label}'")
            elif not curve.lines:
                source.report(f"no value of '{curve.label}' at that time")
        draw(axes, Path(output), reader.start, title or Path(bag).name)
    return int(bool(source.problems))


class _Echoes:
    """The text of messages of a bag, each by the definition of its channel."""

    def __init__(self, reader: BagReader, topic: str, options: EchoOptions, call: Call) -> None:
        from rosz.bags import class_of
        from rosz.introspect import FieldPath, find_target

        self._types = call.types
        self._options = options
        self._now = reader.start
        self._echoes: dict[int, tuple[Channel, Echo, Callable[[Payload], Any]]] = {}
        self._path = FieldPath("")
        self.topics: list[str] = []
        if topic:
            by_type = {channel.type: channel for channel in reader.channels}
            types = {channel.topic: [channel.type] for channel in reader.channels}
            name = names.join("/", topic)
            target = find_target(name, types, lambda each: class_of(by_type[each], self._types))
            self._path, self.topics = target.path, [target.topic]

    def text(self, entry: Entry) -> str | None:
        """Return the text of a message; None if it is left out."""
        self._now = entry.stamp
        channel = entry.channel
        if id(channel) not in self._echoes:
            self._echoes[id(channel)] = (channel, *self._make(channel))
        _, echo, decode = self._echoes[id(channel)]
        try:
            return echo.text(decode(entry.data))
        except LookupError as error:
            warn(f"a message is left out: {error}")
            return None

    def _make(self, channel: Channel) -> tuple[Echo, Callable[[Payload], Any]]:
        from rosz.bags import class_of, decoder_of
        from rosz.introspect import Echo

        kind = self._path.type_in(class_of(channel, self._types))
        echo = Echo(channel.topic, kind, self._path, self._options, lambda: self._now)
        return echo, decoder_of(channel, self._types)
