"""Messages of bags as tables: CSV, Parquet and lines of JSON, one file for each topic.

A message is a row. Its fields are columns with dotted names, ``pose.position.x``, behind ``time``,
when it was received. Times are nanoseconds. Rows are written as they come.
"""

from __future__ import annotations

import csv
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import attrgetter, methodcaller
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import quote

import msgspec

from rosz.bags.bag import Channel, Entry, FileErrors, Payload
from rosz.bags.messages import class_of, decoder_of
from rosz.errors import BagError, UsageError
from rosz.lifecycle import Closing
from rosz.message import ARRAY_CODES, OCTETS, Message, Slot, slots, to_jsonable
from rosz.typestore import TypeStore

_STAMPS = frozenset({"builtin_interfaces/Time", "builtin_interfaces/Duration"})
_GROUP_ROWS = 50_000
_GROUP_BYTES = 16 << 20
_PARQUET = {
    "bool": "bool_",
    "byte": "uint8",
    "char": "uint8",
    "float32": "float32",
    "float64": "float64",
    "string": "string",
    "wstring": "string",
}


def file_names(topics: Iterable[str]) -> dict[str, str]:
    """Return a name for the file of each topic: ``a_b`` for ``/a/b``.

    Where topics would share one, their slashes are ``%2F``. No file's name can have a NUL, which
    is ``%00``.
    """
    plain = {
        topic: topic.strip("/").replace("/", "_").replace("\0", "%00") or "root" for topic in topics
    }
    names = list(plain.values())
    return {
        topic: name if names.count(name) == 1 else quote(topic.strip("/"), safe="")
        for topic, name in plain.items()
    }


_Table: TypeAlias = "_Csv | _Json | _Parquet"


class Tables(Closing):
    """A file in a folder for each topic; two where a topic has messages of two definitions.

    Args:
        folder: The folder; made if it is missing.
        form: ``csv``, ``json`` or ``parquet``.
        channels: The channels whose messages may come.
        types: Types for channels without a definition.
        replace: Whether files that exist are replaced; otherwise they are an error.

    Attributes:
        rows: Number of rows by file.

    Raises:
        BagError: The folder cannot be made.
        UsageError: The library for the format is not installed.
    """

    def __init__(
        self,
        folder: Path,
        form: str,
        channels: Sequence[Channel],
        types: TypeStore,
        *,
        replace: bool = False,
    ) -> None:
        self._folder = folder
        self._suffix, self._kind = TABLES[form]
        if form == "parquet":
            _arrow()
        self._types = types
        self._replace = replace
        self._names = file_names(dict.fromkeys(channel.topic for channel in channels))
        self._numbers: dict[str, list[type[Message]]] = {}
        self._files: dict[Path, _Table] = {}
        self._opened: dict[int, tuple[Channel, Path, Callable[[Payload], Message]]] = {}
        self.rows: dict[Path, int] = {}
        with FileErrors(folder, "cannot make the folder"):
            folder.mkdir(parents=True, exist_ok=True)

    def write(self, entry: Entry) -> None:
        """Write a message into the file of its topic.

        Raises:
            BagError: The file exists, or cannot be written.
            DecodeError: The payload is not a message of the type.
            TypeNotFound: The bag has no definition of the type, and it is not known here.
        """
        opened = self._opened.get(id(entry.channel))
        if opened is None:
            opened = self._opened[id(entry.channel)] = self._open(entry.channel)
        _, file, decode = opened
        message = decode(entry.data)
        with FileErrors(file):
            self._files[file].write(entry.stamp, message)
        self.rows[file] += 1

    def _open(self, channel: Channel) -> tuple[Channel, Path, Callable[[Payload], Message]]:
        decode = decoder_of(channel, self._types)
        cls = class_of(channel, self._types)
        classes = self._numbers.setdefault(channel.topic, [])
        if cls not in classes:
            classes.append(cls)
        number = classes.index(cls)
        name = self._names[channel.topic] + (f"-{number + 1}" if number else "")
        file = self._folder / f"{name}{self._suffix}"
        if file not in self._files:
            if file.exists() and not self._replace:
                raise BagError("it exists already; -f replaces it", str(file))
            with FileErrors(file):
                self._files[file] = self._kind(file, cls)
            self.rows[file] = 0
        return channel, file, decode

    def close(self) -> None:
        """Finish the files.

        Raises:
            BagError: One cannot be written.
        """
        for file, table in self._files.items():
            with FileErrors(file):
                table.close()


class _Leaf(msgspec.Struct, frozen=True):
    """A column: a field whose type is not a message, and its dotted name."""

    name: str
    slot: Slot

    @property
    def is_stamp(self) -> bool:
        return _is_stamp(self.slot.kind)

    @property
    def is_octets(self) -> bool:
        return self.slot.shape != "one" and self.slot.kind in OCTETS


def _is_stamp(kind: type[Any] | str) -> bool:
    return not isinstance(kind, str) and kind._type in _STAMPS


def _leaves(cls: type[Message], before: str = "") -> Iterator[_Leaf]:
    for slot in slots(cls):
        name = f"{before}{slot.name}"
        if slot.shape != "one" or isinstance(slot.kind, str) or _is_stamp(slot.kind):
            yield _Leaf(name, slot)
        else:
            yield from _leaves(slot.kind, f"{name}.")


def _time_name(names: Iterable[str]) -> str:
    """Return the name of the first column, which is not that of a field."""
    return "time_received" if "time" in names else "time"


def _reader(leaves: Sequence[_Leaf]) -> Callable[[Any], tuple[Any, ...]]:
    """Return the function that reads the columns of a message."""
    if not leaves:
        return lambda _: ()
    read = attrgetter(*(leaf.name for leaf in leaves))
    return read if len(leaves) > 1 else lambda message: (read(message),)


class _Csv:
    """Comma-separated values.

    Arrays of a fixed size are columns. Sequences are JSON in one column, since their lengths
    differ. Octets, such as the pixels of images, are left out.
    """

    def __init__(self, file: Path, cls: type[Message]) -> None:
        leaves = [leaf for leaf in _leaves(cls) if not leaf.is_octets]
        self._read = _reader(leaves)
        self._cells = [_cells(leaf) for leaf in leaves]
        self._file = file.open("w", encoding="utf-8", errors="surrogateescape", newline="")
        self._row = csv.writer(self._file, lineterminator="\n").writerow
        names = [name for leaf in leaves for name in _csv_names(leaf)]
        self._row([_time_name(names), *names])

    def write(self, stamp: int, message: Message) -> None:
        row: list[Any] = [stamp]
        for value, cells in zip(self._read(message), self._cells, strict=True):
            row += cells(value)
        self._row(row)

    def close(self) -> None:
        self._file.close()


def _csv_names(leaf: _Leaf) -> list[str]:
    if leaf.slot.shape != "fixed" or not isinstance(leaf.slot.kind, str):
        return [leaf.name]
    return [f"{leaf.name}.{number}" for number in range(leaf.slot.size)]


def _cells(leaf: _Leaf) -> Callable[[Any], Iterable[Any]]:
    """Return the function that makes the cells of a column's value."""
    if leaf.slot.shape != "one":
        if leaf.slot.shape == "fixed" and isinstance(leaf.slot.kind, str):
            return (lambda value: map(int, value)) if leaf.slot.kind == "bool" else tuple
        return lambda value: (msgspec.json.encode([*map(to_jsonable, value)]).decode(),)
    if leaf.is_stamp:
        return lambda value: (value.to_nsec(),)
    return (lambda value: (int(value),)) if leaf.slot.kind == "bool" else lambda value: (value,)


class _Json:
    """Lines of JSON, with all fields."""

    def __init__(self, file: Path, cls: type[Message]) -> None:
        self._time = _time_name(slot.name for slot in slots(cls))
        self._file = file.open("wb")

    def write(self, stamp: int, message: Message) -> None:
        line = {self._time: stamp, **to_jsonable(message)}
        self._file.write(msgspec.json.encode(line) + b"\n")

    def close(self) -> None:
        self._file.close()


class _Parquet:
    """Parquet, with typed columns: sequences are lists, messages in them structs."""

    def __init__(self, file: Path, cls: type[Message]) -> None:
        self._arrow = pa = _arrow()
        from pyarrow import parquet

        leaves = list(_leaves(cls))
        self._read = _reader(leaves)
        self._columns = [_Column(pa, leaf.slot) for leaf in leaves]
        self._stamps = array("q")
        self._size = 0
        fields = [
            (leaf.name, column.type) for leaf, column in zip(leaves, self._columns, strict=True)
        ]
        first = _time_name(leaf.name for leaf in leaves)
        self._schema = pa.schema([(first, pa.timestamp("ns", "UTC")), *fields])
        self._writer = parquet.ParquetWriter(file, self._schema, compression="zstd")

    def write(self, stamp: int, message: Message) -> None:
        self._stamps.append(stamp)
        for value, column in zip(self._read(message), self._columns, strict=True):
            self._size += column.add(value)
        if len(self._stamps) >= _GROUP_ROWS or self._size >= _GROUP_BYTES:
            self._write_group()

    def _write_group(self) -> None:
        pa = self._arrow
        stamps = pa.Array.from_buffers(
            self._schema.field(0).type, len(self._stamps), [None, pa.py_buffer(self._stamps)]
        )
        arrays = [stamps, *(column.take() for column in self._columns)]
        self._writer.write_table(pa.Table.from_arrays(arrays, schema=self._schema))
        self._stamps = array("q")
        self._size = 0

    def close(self) -> None:
        if self._stamps:
            self._write_group()
        self._writer.close()


class _Column:
    """The values of a column that are not written yet."""

    def __init__(self, pa: Any, slot: Slot) -> None:
        self._arrow = pa
        self.type = _arrow_type(pa, slot)
        self._plain = _plain(slot)
        self._code = ""
        if slot.shape != "one" and isinstance(slot.kind, str):
            self._code = ARRAY_CODES.get(slot.kind, "")
        self._fixed = slot.size if slot.shape == "fixed" else 0
        self._clear()

    def _clear(self) -> None:
        self._values: list[Any] = []
        self._flat: Any = array(self._code) if self._code else None
        self._ends = array("i", [0])

    def add(self, value: Any) -> int:
        """Add a value; return about how many bytes it has."""
        if self._flat is not None:
            self._flat.extend(value)
            self._ends.append(len(self._flat))
            return len(value) * int(self._flat.itemsize)
        self._values.append(value if self._plain is None else self._plain(value))
        return len(value) if isinstance(value, str | bytes) else 8

    def take(self) -> Any:
        """Return the array of all values, and forget them."""
        pa = self._arrow
        if self._flat is None:
            try:
                made = pa.array(self._values, self.type)
            except UnicodeEncodeError:  # octets of ROS 1 that are not UTF-8
                made = pa.array([*map(_unicode, self._values)], self.type)
        else:
            kind, flat, count = self.type.value_type, self._flat, len(self._ends) - 1
            inner = pa.Array.from_buffers(kind, len(flat), [None, pa.py_buffer(flat)])
            if self._fixed:
                made = pa.Array.from_buffers(self.type, count, [None], children=[inner])
            else:
                places = [None, pa.py_buffer(self._ends)]
                made = pa.Array.from_buffers(self.type, count, places, children=[inner])
        self._clear()
        return made


def _arrow_type(pa: Any, slot: Slot) -> Any:
    if slot.shape != "one" and slot.kind in OCTETS:
        return pa.binary()
    kind = _arrow_kind(pa, slot.kind)
    if slot.shape == "one":
        return kind
    return pa.list_(kind, slot.size) if slot.shape == "fixed" and slot.size else pa.list_(kind)


def _arrow_kind(pa: Any, kind: type[Any] | str) -> Any:
    if isinstance(kind, str):
        return getattr(pa, _PARQUET.get(kind, kind))()
    if kind._type == "builtin_interfaces/Time":
        return pa.timestamp("ns", "UTC")
    if kind._type == "builtin_interfaces/Duration":
        return pa.duration("ns")
    return pa.struct([(slot.name, _arrow_type(pa, slot)) for slot in slots(kind)])


def _plain(slot: Slot) -> Callable[[Any], Any] | None:
    """Return the function that makes of a value what pyarrow takes; None if it takes it."""
    if isinstance(slot.kind, str):
        return None
    kind = slot.kind
    make_plain: Callable[[Any], Any]
    if _is_stamp(kind):
        make_plain = methodcaller("to_nsec")
    else:
        inner = [(each.name, _plain(each)) for each in slots(kind)]

        def make_plain(message: Any) -> Any:
            return {
                name: getattr(message, name) if make is None else make(getattr(message, name))
                for name, make in inner
            }

    return make_plain if slot.shape == "one" else lambda values: [*map(make_plain, values)]


def _unicode(value: Any) -> Any:
    """Return a value with question marks in place of octets that are not text."""
    if isinstance(value, dict):
        return {name: _unicode(member) for name, member in value.items()}
    if isinstance(value, list):
        return [*map(_unicode, value)]
    return value.encode("utf-8", "replace").decode() if isinstance(value, str) else value


def _arrow() -> Any:
    try:
        import pyarrow as pa
    except ImportError as error:
        raise UsageError("Parquet needs a library: pip install 'rosz[parquet]'") from error
    return pa


TABLES: dict[str, tuple[str, Callable[[Path, type[Message]], _Table]]] = {
    "csv": (".csv", _Csv),
    "json": (".jsonl", _Json),
    "parquet": (".parquet", _Parquet),
}
"""Suffix and class of each format."""
