"""``rosz bag filter``, ``convert``, ``merge``, ``split``, ``cat`` and ``export``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TextIO

from rosz.cli import suggest
from rosz.cli.bag.group import app
from rosz.cli.bag.play import list_topics
from rosz.cli.call import Call
from rosz.cli.console import count, print_error, print_lines, warn
from rosz.cli.declare import Argument, Json, Option, at_least, no_less_than_zero
from rosz.errors import NotFoundError, UsageError, near_miss

if TYPE_CHECKING:
    from rosz.bags import BagReader, BagWriter, Channel, Compression, Entry, Payload
    from rosz.errors import BagError
    from rosz.introspect.echo import Echo, EchoOptions

__all__ = ()

_NS = 1_000_000_000
_COMPRESSIONS = ("none", "bz2", "lz4", "zstd")

_Bag = Annotated[str, Argument("BAG", source=suggest.files)]
_Output = Annotated[
    str, Argument("OUTPUT", "NAME.mcap, NAME.bag, or NAME/ for a folder of rosbag2.")
]
_Topics = Annotated[
    list[str] | None, Option("--topics TOPIC", "Take these topics only; several may follow.")
]
_Start = Annotated[float, Option("-s --start SECONDS", "Leave out the beginning.")]
_End = Annotated[float | None, Option("--end SECONDS", "Leave out what is later in the bag.")]
_Compression = Annotated[
    str, Option("--compression NAME", "none, lz4, or bz2 (.bag) or zstd (.mcap, rosbag2).")
]
_To = Annotated[
    str, Option("--to FORMAT", "mcap, rosbag or rosbag2, if OUTPUT does not tell the format.")
]
_Storage = Annotated[
    str, Option("--storage NAME", "Storage of rosbag2: mcap (the default) or sqlite3.")
]


class _Problems:
    """Prints problems, and counts them."""

    def __init__(self) -> None:
        self.count = 0

    def report(self, problem: BagError | str) -> None:
        self.count += 1
        print_error(f"ERROR: {problem}")


class _Input:
    """Bags that are read, and what is chosen of them."""

    def __init__(self, readers: Sequence[BagReader], problems: _Problems) -> None:
        self.readers = readers
        self.problems = problems

    def entries(
        self, topics: Sequence[str] | None = None, start: float = 0.0, end: float | None = None
    ) -> Iterator[Entry]:
        from rosz.bags.editing import merged

        known = {channel.topic for one in self.readers for channel in one.channels}
        wanted = {one if one.startswith("/") else f"/{one}" for one in topics or ()}
        for one in sorted(wanted - known):
            raise NotFoundError(f"no topic '{one}' in the bag{near_miss(one, known)}")
        first = min((one.start for one in self.readers if one.count()), default=0)
        return merged(
            self.readers,
            self.problems.report,
            topics=wanted or None,
            start=first + int(start * _NS) if start else None,
            end=None if end is None else first + int(end * _NS),
        )


@contextmanager
def _open(bags: Sequence[str]) -> Iterator[_Input]:
    from rosz.bags import open_reader

    with ExitStack() as stack:
        readers = [stack.enter_context(open_reader(bag)) for bag in bags]
        problems = _Problems()
        for reader in readers:
            for problem in reader.problems:
                problems.report(problem)
        yield _Input(readers, problems)


def _compression(name: str) -> Compression:
    if name not in _COMPRESSIONS:
        raise UsageError(f"--compression is '{name}'; expected {', '.join(_COMPRESSIONS)}")
    return name  # type: ignore[return-value]


def _check_times(start: float, end: float | None) -> None:
    no_less_than_zero("--start", start)
    no_less_than_zero("--end", end)


def _check_output(output: str, bags: Sequence[str]) -> None:
    if any(Path(output).resolve() == Path(bag).resolve() for bag in bags):
        raise UsageError(f"'{output}' is both read and written")


@app.command("filter", arrange=list_topics)
def filter_command(
    call: Call,
    bag: _Bag,
    output: _Output,
    expression: Annotated[
        str, Argument("EXPRESSION", "Python; topic, m (the message) and t (its time) are known.")
    ] = "",
    *,
    show: Annotated[
        str, Option("-p --print EXPRESSION", "Print the value of this for each message.")
    ] = "",
    topics: _Topics = None,
    start: _Start = 0.0,
    end: _End = None,
    compression: _Compression = "none",
) -> int:
    """Write some of the messages of a bag into another one."""
    from rosz.bags import Bag, create_writer
    from rosz.bags.editing import Transfer
    from rosz.introspect.fields import Filter
    from rosz.msgs.builtin_interfaces.msg import Time

    _check_times(start, end)
    _check_output(output, [bag])
    condition = Filter(expression) if expression else None
    shown = Filter(show) if show else None
    types = call.types
    with _open([bag]) as source:
        decode = Bag(source.readers[0], types).decoder
        entries = source.entries(topics, start, end)
        with create_writer(output, compression=_compression(compression), replace=True) as writer:
            transfer = Transfer(writer, types, source.problems.report)
            for entry in entries:
                if condition is not None or shown is not None:
                    topic = entry.channel.topic
                    message: Any = decode(entry.channel)(entry.data)
                    stamp = Time.from_nsec(entry.stamp)
                    taken = condition is None or condition.accepts(message, topic, stamp)
                    if shown is not None:
                        value = shown.value(message, topic, stamp)
                        print_lines([f"{'MATCH' if taken else 'NO MATCH'} {value}"])
                    if not taken:
                        continue
                transfer.write(entry)
    print_lines([f"{output}: {count(transfer.count, 'message')}"])
    return int(bool(source.problems.count))


@app.command("convert")
def convert_command(
    call: Call,
    bag: _Bag,
    output: _Output,
    *,
    to: _To = "",
    storage: _Storage = "",
    compression: _Compression = "none",
) -> int:
    """Write a bag in another format: MCAP, that of ROS 1, or a folder of rosbag2."""
    return _write(call, [bag], output, _Form(to, storage, compression))


@app.command("merge")
def merge_command(
    call: Call,
    bags: Annotated[list[str], Argument("BAG", source=suggest.files)],
    *,
    output: Annotated[
        str, Option("-o --output OUTPUT", "The new bag: NAME.mcap, NAME.bag or NAME/.")
    ],
    to: _To = "",
    storage: _Storage = "",
    compression: _Compression = "none",
) -> int:
    """Write several bags into one, merged by time."""
    return _write(call, bags, output, _Form(to, storage, compression))


class _Form(NamedTuple):
    """The format of a new bag, as options give it."""

    to: str
    storage: str
    compression: str

    def create(self, output: str) -> BagWriter:
        """Create the bag."""
        from rosz.bags import FORMATS, STORAGES, create_writer, form_of

        if self.to and self.to not in FORMATS:
            raise UsageError(f"--to is '{self.to}'; expected {', '.join(FORMATS)}")
        if self.storage and self.storage not in STORAGES:
            raise UsageError(f"--storage is '{self.storage}'; expected {' or '.join(STORAGES)}")
        form = self.to or ("rosbag2" if self.storage else form_of(output))
        if self.storage and form != "rosbag2":
            raise UsageError(f"--storage is for rosbag2, and the new bag is of the format {form}")
        return create_writer(
            output,
            compression=_compression(self.compression),
            form=form,
            storage=self.storage or "mcap",
        )


def _write(call: Call, bags: Sequence[str], output: str, form: _Form) -> int:
    from rosz.bags.editing import Transfer

    _check_output(output, bags)
    with (
        _open(bags) as source,
        form.create(output) as writer,
    ):
        for reader in source.readers:
            for name, texts in reader.metadata.items():
                writer.add_metadata(name, texts)
            for attachment in reader.attachments():
                writer.add_attachment(attachment)
        transfer = Transfer(writer, call.types, source.problems.report)
        for entry in source.entries():
            transfer.write(entry)
    print_lines([f"{output}: {count(transfer.count, 'message')}"])
    return int(bool(source.problems.count))


@app.command("split")
def split_command(
    call: Call,
    bag: _Bag,
    *,
    duration: Annotated[float, Option("-u --duration SECONDS", "Longest time of a part.")] = 0.0,
    size: Annotated[int, Option("--size MB", "Largest size of the messages in a part.")] = 0,
    output: Annotated[
        str, Option("-o --output OUTPUT", "NAME.mcap makes NAME_0.mcap; the bag if omitted.")
    ] = "",
    compression: _Compression = "none",
) -> int:
    """Write a bag as several ones, by time or size."""
    from rosz.bags.editing import divide

    no_less_than_zero("--duration", duration)
    at_least("--size", size, 0, "MB")
    with _open([bag]) as source:
        parts = divide(
            source.entries(),
            output or (bag if Path(bag).is_file() else f"{bag.rstrip('/')}/"),
            call.types,
            source.problems.report,
            seconds=duration,
            size=size << 20,
            compression=_compression(compression),
        )
        for file, number in parts:
            print_lines([f"{file}: {count(number, 'message')}"])
    return int(bool(source.problems.count))


@app.command("cat", arrange=list_topics)
def cat_command(
    call: Call,
    bag: _Bag,
    topic: Annotated[str, Argument("TOPIC_OR_FIELD", "All topics if omitted.")] = "",
    *,
    limit: Annotated[int | None, Option("-n COUNT", "Stop after this number of messages.")] = None,
    plot: Annotated[bool, Option("-p", "Print comma-separated numbers, for plotting.")] = False,
    condition: Annotated[
        str, Option("--filter EXPRESSION", "Use only messages for which this is true.")
    ] = "",
    nostr: Annotated[bool, Option("--nostr", "Leave strings out.")] = False,
    noarr: Annotated[bool, Option("--noarr", "Leave arrays out.")] = False,
    start: _Start = 0.0,
    end: _End = None,
    json: Json = False,
) -> int:
    """Print the messages of a bag, as topic echo prints them."""
    from rosz.introspect.echo import EchoOptions
    from rosz.introspect.fields import Filter

    _check_times(start, end)
    at_least("-n", limit, 1, "messages")
    options = EchoOptions(
        plot=plot,
        as_json=json,
        no_arrays=noarr,
        no_strings=nostr,
        condition=Filter(condition) if condition else None,
    )
    with _open([bag]) as source:
        echoes = _Echoes(source.readers[0], topic, options, call)
        for entry in source.entries(echoes.topics, start, end):
            text = echoes.text(entry)
            if text is None:
                continue
            sys.stdout.write(text)
            if limit is not None:
                limit -= 1
                if not limit:
                    break
    return int(bool(source.problems.count))


@app.command("export", arrange=list_topics)
def export_command(
    call: Call,
    bag: _Bag,
    folder: Annotated[str, Argument("DIR", "The folder of the files; made if it is missing.")],
    *,
    topics: _Topics = None,
    start: _Start = 0.0,
    end: _End = None,
    json: Annotated[bool, Option("--json", "Write lines of JSON, with all fields.")] = False,
) -> int:
    """Write each topic of a bag into a CSV file, one row per message."""
    from rosz.introspect.echo import EchoOptions

    _check_times(start, end)
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    suffix = "jsonl" if json else "csv"
    rows: dict[str, int] = {}
    with _open([bag]) as source, ExitStack() as files:
        echoes = _Echoes(source.readers[0], "", EchoOptions(plot=not json, as_json=json), call)
        opened: dict[str, TextIO] = {}
        for entry in source.entries(topics, start, end):
            topic = entry.channel.topic
            text = echoes.text(entry)
            if text is None:
                continue
            if topic not in opened:
                file = target / f"{topic.strip('/').replace('/', '_')}.{suffix}"
                opened[topic] = files.enter_context(file.open("w", encoding="utf-8"))
            opened[topic].write(text)
            rows[topic] = rows.get(topic, 0) + 1
    print_lines(f"{topic}: {count(number, 'row')}" for topic, number in sorted(rows.items()))
    return int(bool(source.problems.count))


class _Echoes:
    """The text of messages of a bag, each by the definition of its channel."""

    def __init__(self, reader: BagReader, topic: str, options: EchoOptions, call: Call) -> None:
        from rosz.bags import class_of
        from rosz.introspect.fields import FieldPath, find_target

        self._types = call.types
        self._options = options
        self._now = reader.start
        self._echoes: dict[int, tuple[Channel, Echo, Callable[[Payload], Any]]] = {}
        self._path = FieldPath("")
        self.topics: list[str] = []
        if topic:
            by_type = {one.type: one for one in reader.channels}
            known = {one.topic: [one.type] for one in reader.channels}
            name = topic if topic.startswith("/") else f"/{topic}"
            target = find_target(name, known, lambda each: class_of(by_type[each], self._types))
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
        from rosz.introspect.echo import Echo

        kind = self._path.type_in(class_of(channel, self._types))
        echo = Echo(channel.topic, kind, self._path, self._options, lambda: self._now)
        return echo, decoder_of(channel, self._types)
