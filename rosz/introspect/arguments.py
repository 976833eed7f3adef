"""Messages from YAML: arguments of a command, documents of a file or a stream."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosz.errors import EncodeError, NotFoundError, UsageError, YamlError
from rosz.message import fill_message_args, slots
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.params.yaml import read_plain
from rosz.time import DurationValue, TimeValue

_STREAM = "standard input"
_FEW = 60


def read_arguments(words: Sequence[str]) -> list[Any]:
    """Return the values of command-line arguments; an empty one is an empty string.

    Raises:
        UsageError: An argument is not YAML.
    """
    return [_read_argument(word, number) for number, word in enumerate(words, 1)]


def _read_argument(word: str, number: int) -> Any:
    try:
        documents = list(read_plain(word, "<value>")) if word else [""]
    except YamlError as error:
        raise UsageError(
            f"value {number}, '{word:.{_FEW}}', is not YAML: {error.reason}"
        ) from error
    if len(documents) > 1:
        raise UsageError(
            f"value {number}, '{word:.{_FEW}}', is {len(documents)} YAML documents; expected one"
        )
    return documents[0] if documents else None


def read_file(path: Path) -> list[Any]:
    """Return the documents of a YAML file, without the empty ones.

    Raises:
        NotFoundError: The file does not exist.
        YamlError: The file is not YAML.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise NotFoundError(f"file '{path}' is not there") from error
    return list(_read(data, str(path)))


def read_stream(lines: Iterable[bytes], warn: Callable[[str], None]) -> Iterator[Any]:
    """Yield the YAML documents of a stream, each as soon as a line of three dashes ends it.

    The text after the last such line counts as unfinished and is skipped, as in ROS 1's tools.

    Args:
        lines: Lines of the stream.
        warn: Function called with a sentence about a document that is skipped.

    Raises:
        YamlError: A document is not YAML.
    """
    begun: list[bytes] = []
    for number, line in enumerate(lines, 1):
        if line.strip() != b"---":
            begun.append(line)
            continue
        before = number - len(begun) - 1
        try:
            documents = list(_read(b"".join(begun), _STREAM))
        except YamlError as error:
            raise YamlError(error.reason, _STREAM, before + error.line, error.column) from error
        begun.clear()
        yield from documents
    if b"".join(begun).strip():
        warn(f"{_STREAM} ends without a line '---': what comes after the last one is left out")


def _read(data: bytes, path: str) -> Iterator[Any]:
    """Yield the documents that are not empty."""
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise YamlError(f"byte {data[error.start]:#04x} is not UTF-8", path, line) from error
    yield from (document for document in read_plain(text, path) if document is not None)


def make_message(cls: type[Any], arguments: Sequence[Any], now: int) -> Any:
    """Make a message from values that were read as YAML.

    Args:
        cls: The message class.
        arguments: One dictionary of fields, or a value for each field.
        now: ROS time in nanoseconds, for ``now`` and ``auto``.

    Raises:
        EncodeError: A value does not fit; the error names the field and what was expected.
    """
    message = cls()
    fill_message_args(message, list(arguments), {"now": Time.from_nsec(now)})
    cls._encode(message)  # raises for a wrong value before anything is sent
    return message


def list_arguments(cls: type[Any]) -> str:
    """Return the names of the values that a message is made of, as ``rosservice args`` prints."""
    return " ".join(_arguments(cls, ""))


@contextmanager
def listing_arguments(cls: type[Any]) -> Iterator[None]:
    """Let the errors of a message list its values, unless they list them already."""
    try:
        yield
    except EncodeError as error:
        if not error.field and list_arguments(cls) == " ".join(cls.__slots__):
            raise
        between = " " if error.reason.endswith("?") else "; "
        reason = f"{error.reason}{between}the values are: [{list_arguments(cls)}]"
        raise EncodeError(error.type_name, error.field, reason) from error


def _arguments(cls: type[Any], prefix: str) -> list[str]:
    arguments: list[str] = []
    kinds = {slot.name: slot for slot in slots(cls)}
    for name in cls.__slots__:
        slot = kinds.get(name)
        kind = slot.kind if slot is not None and slot.shape == "one" else ""
        if isinstance(kind, type) and not issubclass(kind, TimeValue | DurationValue):
            arguments += _arguments(kind, f"{prefix}{name}.")
        else:
            arguments.append(prefix + name)
    return arguments
