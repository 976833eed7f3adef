"""Values that a person writes as YAML: arguments of a command, documents of a file or a stream."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

import yaml

from rosz.errors import NotFoundError, UsageError, YamlError

__all__ = ("read_arguments", "read_file", "read_stream")

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def read_arguments(words: Sequence[str]) -> list[Any]:
    """Return the values of command-line arguments; an empty one is an empty text.

    Raises:
        UsageError: One of them is no YAML.
    """
    values: list[Any] = []
    for number, word in enumerate(words, 1):
        try:
            values.append(yaml.load(word, _Loader) if word else "")  # noqa: S506  # a safe one
        except yaml.YAMLError as error:
            raise UsageError(
                f"value {number}, '{word}', is no YAML: {_reason(error)[0]}"
            ) from error
    return values


def read_file(path: Path) -> list[Any]:
    """Return the documents of a file, empty ones left out.

    Raises:
        NotFoundError: It is not there.
        YamlError: It is no YAML.
    """
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError as error:
        raise NotFoundError(f"file '{path}' is not there") from error
    except UnicodeDecodeError as error:
        raise YamlError("not UTF-8", str(path), text_line(error), 1) from error
    try:
        return [one for one in yaml.load_all(text, _Loader) if one is not None]
    except yaml.YAMLError as error:
        reason, line, column = _reason(error)
        raise YamlError(reason, str(path), line, column) from error


def read_stream(lines: Iterable[str] | TextIO) -> Iterator[Any]:
    """Yield the documents of a stream as they end, each with a line of three dashes.

    What follows the last such line is taken for unfinished, and left out, as ROS 1's tools do.

    Raises:
        YamlError: A document is no YAML.
    """
    begun: list[str] = []
    for number, line in enumerate(lines, 1):
        if line.strip() != "---":
            begun.append(line)
            continue
        try:
            value = yaml.load("".join(begun), _Loader)  # noqa: S506  # a safe one
        except yaml.YAMLError as error:
            reason, at, column = _reason(error)
            raise YamlError(
                reason, "standard input", number - len(begun) + at - 1, column
            ) from error
        begun.clear()
        if value is not None:
            yield value


def text_line(error: UnicodeDecodeError) -> int:
    """Return the line, from 1, of what cannot be decoded."""
    return error.object[: error.start].count(b"\n") + 1


def _reason(error: yaml.YAMLError) -> tuple[str, int, int]:
    """Return what is wrong in one line, and line and column from 1, 0 where unknown."""
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error).partition("\n")[0]
    return (problem, mark.line + 1, mark.column + 1) if mark else (problem, 0, 0)
