"""``rosz bag filter``, ``convert``, ``merge`` and ``split``."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from rosz.cli import suggest
from rosz.cli.bag.play import list_topics
from rosz.cli.bag.source import BagArgument, Part, app, check_times, open_bags
from rosz.cli.call import Call
from rosz.cli.console import count, print_lines
from rosz.cli.declare import Argument, Option, at_least, no_less_than_zero
from rosz.errors import BagError, RoszError, UsageError

if TYPE_CHECKING:
    from rosz.bags import BagWriter, Compression

_NS = 1_000_000_000
_COMPRESSIONS = ("none", "bz2", "lz4", "zstd")

_Output = Annotated[
    str, Argument("OUTPUT", "NAME.mcap, NAME.bag, or NAME/ for a folder of rosbag2.")
]
_Compression = Annotated[
    str, Option("--compression NAME", "none, lz4, or bz2 (.bag) or zstd (.mcap, rosbag2).")
]
_To = Annotated[
    str, Option("--to FORMAT", "mcap, rosbag or rosbag2, if OUTPUT does not tell the format.")
]
_Storage = Annotated[
    str, Option("--storage NAME", "Storage of rosbag2: mcap (the default) or sqlite3.")
]


def _compression(name: str) -> Compression:
    if name not in _COMPRESSIONS:
        raise UsageError(f"--compression is '{name}'; expected {', '.join(_COMPRESSIONS)}")
    return name  # type: ignore[return-value]


def _check_output(output: str, bags: Sequence[str]) -> None:
    if any(Path(output).resolve() == Path(bag).resolve() for bag in bags):
        raise UsageError(f"'{output}' is both read and written")


@app.command("filter", arrange=list_topics)
def filter_command(
    call: Call,
    bag: BagArgument,
    output: _Output,
    expression: Annotated[
        str, Argument("EXPRESSION", "Python; topic, m (the message) and t (its time) are known.")
    ] = "",
    *,
    show: Annotated[
        str, Option("-p --print EXPRESSION", "Print the value of this for each message.")
    ] = "",
    part: Part,
    compression: _Compression = "none",
) -> int:
    """Write some of the messages of a bag into another one."""
    from rosz.bags import Bag
    from rosz.bags.edit import Transfer
    from rosz.introspect import Filter, FilterFailed
    from rosz.msgs.builtin_interfaces.msg import Time

    check_times(part.start, part.end)
    _check_output(output, [bag])
    condition = Filter(expression) if expression else None
    shown = Filter(show) if show else None
    types = call.types
    with open_bags([bag]) as source, _created(output, compression) as writer:
        decode = Bag(source.readers[0], types).decoder
        transfer = Transfer(writer, types, source.report)
        for number, entry in enumerate(source.entries(part), 1):
            if condition is not None or shown is not None:
                topic = entry.channel.topic
                message: Any = decode(entry.channel)(entry.data)
                stamp = Time.from_nsec(entry.stamp)
                try:
                    taken = condition is None or condition.accepts(message, topic, stamp)
                    value = shown.value(message, topic, stamp) if shown is not None else None
                except FilterFailed as error:
                    place = f"at message {number}, of '{topic}' at {entry.stamp / _NS:.9f}"
                    raise RoszError(f"{error}, {place}") from error
                if shown is not None:
                    print_lines([f"{'MATCH' if taken else 'NO MATCH'} {value}"])
                if not taken:
                    continue
            transfer.write(entry)
    print_lines([f"{output}: {count(transfer.count, 'message')}"])
    return int(bool(source.problems))


@contextmanager
def _created(output: str, compression: str) -> Iterator[BagWriter]:
    """Create a bag; a file of its name is replaced when the new one is complete."""
    from rosz.bags import create_writer, form_of
    from rosz.bags.formats import removed_unfinished

    form, wanted = form_of(output), _compression(compression)
    target = Path(output)
    made = target
    if form != "rosbag2":
        made = target.with_name(f".{target.stem}.part{os.getpid()}{target.suffix}")
    writer = create_writer(made, compression=wanted, form=form, replace=True)
    with removed_unfinished(made, output):
        with writer:
            yield writer
        if made != target:
            try:
                made.replace(target)
            except OSError as error:
                raise BagError(f"cannot create it: {error.strerror}", output) from error


@app.command("convert")
def convert_command(
    call: Call,
    bag: BagArgument,
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
    from rosz.bags.edit import Transfer

    _check_output(output, bags)
    with open_bags(bags) as source, form.create(output) as writer:
        for reader in source.readers:
            for name, texts in reader.metadata.items():
                writer.add_metadata(name, texts)
            for attachment in reader.attachments():
                writer.add_attachment(attachment)
        transfer = Transfer(writer, call.types, source.report)
        for entry in source.entries(Part()):
            transfer.write(entry)
    print_lines([f"{output}: {count(transfer.count, 'message')}"])
    return int(bool(source.problems))


@app.command("split")
def split_command(
    call: Call,
    bag: BagArgument,
    *,
    duration: Annotated[float, Option("-u --duration SECONDS", "Longest time of a part.")] = 0.0,
    size: Annotated[int, Option("--size MB", "Largest size of the messages in a part.")] = 0,
    output: Annotated[
        str, Option("-o --output OUTPUT", "NAME.mcap makes NAME_0.mcap; the bag if omitted.")
    ] = "",
    compression: _Compression = "none",
) -> int:
    """Write a bag as several ones, by time or size."""
    from rosz.bags.edit import divide

    no_less_than_zero("--duration", duration)
    at_least("--size", size, 0, "MB")
    with open_bags([bag]) as source:
        parts = divide(
            source.entries(Part()),
            output or (bag if Path(bag).is_file() else f"{bag.rstrip('/')}/"),
            call.types,
            source.report,
            seconds=duration,
            size=size << 20,
            compression=_compression(compression),
        )
        for file, number in parts:
            print_lines([f"{file}: {count(number, 'message')}"])
    return int(bool(source.problems))
