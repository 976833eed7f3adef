"""Where values of parameters come from and go to: words, standard input, files."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rosz.cli.param_plain import read_plain
from rosz.errors import NotFoundError, RoszError, UsageError, YamlError

if TYPE_CHECKING:
    from rosz.params import Value

__all__ = ("check_target", "read_text", "read_value")

_STDIN = "<stdin>"


def read_value(value: str | None, text_file: str, binary_file: str) -> Value:
    """Return what is to be set, from wherever it is."""
    if binary_file:
        return _bytes(binary_file, UsageError)
    if text_file:
        return _text(_bytes(text_file, UsageError), text_file)
    found = read_plain(value or "")
    if found is not None:
        return found
    from rosz.params.yaml import load

    if value == "-":
        return load(_stdin(), _STDIN)
    return load(value or "", "<value>")


def read_text(file: str) -> tuple[str, str]:
    """Return a text to load, and what to call it."""
    if file == "-":
        return _stdin(), _STDIN
    return _text(_bytes(file, NotFoundError), file), file


def _stdin() -> str:
    return _text(sys.stdin.buffer.read(), _STDIN)


def check_target(file: str) -> None:
    """Refuse to write through a link, by which somebody else could have a file overwritten."""
    from pathlib import Path

    if Path(file).is_symlink():
        raise UsageError(f"'{file}' is a link to '{Path(file).readlink()}'; name the file itself")


def _bytes(file: str, error: type[RoszError]) -> bytes:
    from pathlib import Path

    if not Path(file).is_file():
        what = "is no regular file" if Path(file).exists() else "does not exist"
        raise error(f"file '{file}' {what}")
    return Path(file).read_bytes()


def _text(content: bytes, file: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        reason = f"byte {content[error.start]:#04x} is no UTF-8; save the file as UTF-8"
        raise YamlError(reason, file, line) from error
