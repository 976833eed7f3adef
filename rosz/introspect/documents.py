"""Values that a person writes as YAML: arguments of a command, documents of a file or a stream."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rosz.errors import NotFoundError, UsageError, YamlError
from rosz.params.nodes import read_plain

__all__ = ("read_arguments", "read_file", "read_stream")

_STREAM = "standard input"
_FEW = 60


def read_arguments(words: Sequence[str]) -> list[Any]:
    """Return the values of command-line arguments; an empty one is an empty text.

    Raises:
        UsageError: One of them is no YAML.
    """
    return [_read_argument(word, number) for number, word in enumerate(words, 1)]


def _read_argument(word: str, number: int) -> Any:
    try:
        found = list(read_plain(word, "<value>")) if word else [""]
    except YamlError as error:
        raise UsageError(f"value {number}, '{word:.{_FEW}}', is no YAML: {error.reason}") from error
    if len(found) > 1:
        raise UsageError(
            f"value {number}, '{word:.{_FEW}}', is {len(found)} YAML documents; expected one"
        )
    return found[0] if found else None


def read_file(path: Path) -> list[Any]:
    """Return the documents of a file, empty ones left out.

    Raises:
        NotFoundError: It is not there.
        YamlError: It is no YAML.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise NotFoundError(f"file '{path}' is not there") from error
    return list(_read(data, str(path)))


def read_stream(lines: Iterable[bytes], tell: Callable[[str], None]) -> Iterator[Any]:
    """Yield the documents of a stream as they end, each with a line of three dashes.

    What follows the last such line is taken for unfinished, and left out, as ROS 1's tools do.

    Args:
        lines: The stream.
        tell: Is called with what to say of a document that is left out.

    Raises:
        YamlError: A document is no YAML.
    """
    begun: list[bytes] = []
    for number, line in enumerate(lines, 1):
        if line.strip() != b"---":
            begun.append(line)
            continue
        before = number - len(begun) - 1
        try:
            found = list(_read(b"".join(begun), _STREAM))
        except YamlError as error:
            raise YamlError(error.reason, _STREAM, before + error.line, error.column) from error
        begun.clear()
        yield from found
    if b"".join(begun).strip():
        tell(f"{_STREAM} ends without a line '---': what comes after the last one is left out")


def _read(data: bytes, path: str) -> Iterator[Any]:
    """Yield the documents that are not empty."""
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise YamlError(f"byte {data[error.start]:#04x} is no UTF-8", path, line) from error
    yield from (one for one in read_plain(text, path) if one is not None)
