"""Values written in definitions: of constants, and defaults of fields."""

from __future__ import annotations

import re
from typing import NoReturn

from rosz.idl.spec import FieldType, Scalar, Value

__all__ = ("LiteralError", "read_constant", "read_default")

_INTEGER = re.compile(r"[+-]?(?:0[xX][0-9a-fA-F]+|0[bB][01]+|0[oO][0-7]+|[0-9]+)")
_FLOAT = re.compile(
    r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|inf(?:inity)?|nan)", re.IGNORECASE
)
_QUOTED = re.compile(r"""'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*\"""")
_BARE = re.compile(r"[^\s,\]#]+")
_BARE_TEXT = re.compile(r"[^#]*[^#\s]")
_ESCAPE = re.compile(r"\\(?:u([0-9a-fA-F]{4})|x([0-9a-fA-F]{2})|(.))")
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "0": "\0", "a": "\a", "b": "\b", "f": "\f", "v": "\v"}
_BOOLEANS = {"true": True, "false": False, "1": True, "0": False}
_RANGES = {f"int{n}": (-(1 << (n - 1)), (1 << (n - 1)) - 1) for n in (8, 16, 32, 64)}
_RANGES |= {f"uint{n}": (0, (1 << n) - 1) for n in (8, 16, 32, 64)}
_RANGES |= {"byte": (-0x80, 0xFF), "char": (0, 0xFF)}


class LiteralError(Exception):
    """A value that does not fit; the grammar turns it into an error with a place.

    Attributes:
        offset: Where in the text.
    """

    def __init__(self, offset: int, reason: str) -> None:
        self.offset = offset
        super().__init__(reason)


class _RangeError(LiteralError):
    """A number of the right sort that is too large or too small."""


def read_constant(kind: str, line: str, start: int) -> tuple[Scalar, str]:
    """Read the value of a constant: what is right of its ``=``.

    Args:
        kind: Its type.
        line: The whole line.
        start: Where the value begins.

    Returns:
        The value, and its text as ROS 1 hashes it.

    Raises:
        LiteralError: It is no value of the type.
    """
    if kind in ("string", "wstring"):
        # ROS 1 takes the rest of the line, quotes and # included; ROS 2 quotes its strings.
        text = line[start:].strip()
        quoted = _QUOTED.match(text)
        if quoted and (quoted.end() == len(text) or text[quoted.end() :].lstrip().startswith("#")):
            return _unquote(quoted[0]), text
        return text, text
    text = line[start:].partition("#")[0]
    lead = len(text) - len(text.lstrip())
    text = text.strip()
    return _scalar(kind, text, start + lead), text


def read_default(field: FieldType, line: str, start: int) -> tuple[Value, int]:
    """Read the default of a field.

    Returns:
        The value and where it ends.

    Raises:
        LiteralError: It is no value of the type.
    """
    if field.shape != "one":
        return _list(field, line, start)
    if field.base in ("string", "wstring"):
        value, end = _text(line, start, _BARE_TEXT)
        _check_bound(field, value, start)
        return value, end
    bare = _BARE.match(line, start)
    if bare is None:
        raise LiteralError(start, f"expected a default of type {field.base}")
    try:
        return _scalar(field.base, bare[0], start), bare.end()
    except _RangeError:
        raise
    except LiteralError as error:
        reason = f"expected a default of type {field.base}, or a comment after '#', got '{bare[0]}'"
        raise LiteralError(start, reason) from error


def _list(field: FieldType, line: str, start: int) -> tuple[Value, int]:
    if not line.startswith("[", start):
        raise LiteralError(
            start, f"expected a list '[…]' as default of an array, got '{line[start:].strip()}'"
        )
    values: list[Scalar] = []
    at = _skip(line, start + 1)
    while not line.startswith("]", at):
        if values:
            if not line.startswith(",", at):
                _unclosed(line, start, at)
            at = _skip(line, at + 1)
        value, end = _element(field, line, at)
        values.append(value)
        at = _skip(line, end)
    if field.shape == "fixed" and len(values) != field.size:
        raise LiteralError(start, f"expected {field.size} elements, got {len(values)}")
    if field.shape == "bounded" and len(values) > field.size:
        raise LiteralError(start, f"expected at most {field.size} elements, got {len(values)}")
    return tuple(values), at + 1


def _unclosed(line: str, start: int, at: int) -> NoReturn:
    if at >= len(line) or line[at] == "#":
        raise LiteralError(start, "the list is not closed; expected ']'")
    raise LiteralError(at, f"expected ',' or ']' in the list, got '{line[at]}'")


def _element(field: FieldType, line: str, at: int) -> tuple[Scalar, int]:
    if field.base in ("string", "wstring"):
        value, end = _text(line, at, _BARE)
        _check_bound(field, value, at)
        return value, end
    bare = _BARE.match(line, at)
    if bare is None:
        if at >= len(line) or line[at] == "#":
            raise LiteralError(at, "the list is not closed; expected ']'")
        raise LiteralError(at, f"expected a value of type {field.base}, got '{line[at]}'")
    return _scalar(field.base, bare[0], at), bare.end()


def _text(line: str, at: int, bare: re.Pattern[str]) -> tuple[str, int]:
    if line[at : at + 1] in ("'", '"'):
        quoted = _QUOTED.match(line, at)
        if quoted is None:
            raise LiteralError(at, f"the string is not closed; expected {line[at]}")
        return _unquote(quoted[0]), quoted.end()
    plain = bare.match(line, at)
    if plain is None:
        raise LiteralError(at, "expected a string")
    return plain[0], plain.end()


def _check_bound(field: FieldType, value: str, at: int) -> None:
    if field.bound and len(value.encode()) > field.bound:
        raise LiteralError(at, f"'{value}' is longer than the {field.bound} bytes of its type")


def _unquote(text: str) -> str:
    def replace(escape: re.Match[str]) -> str:
        code = escape[1] or escape[2]
        return chr(int(code, 16)) if code else _ESCAPED.get(escape[3], escape[3])

    return _ESCAPE.sub(replace, text[1:-1])


def _skip(line: str, at: int) -> int:
    while line[at : at + 1] in (" ", "\t"):
        at += 1
    return at


def _scalar(kind: str, text: str, at: int) -> Scalar:
    if not text:
        raise LiteralError(at, f"expected a value of type {kind}")
    if kind == "bool":
        if text.lower() not in _BOOLEANS:
            raise LiteralError(at, f"expected true or false, got '{text}'")
        return _BOOLEANS[text.lower()]
    if kind in ("float32", "float64"):
        if _INTEGER.fullmatch(text):
            return float(_integer(text))
        if not _FLOAT.fullmatch(text):
            raise LiteralError(at, f"expected a number of type {kind}, got '{text}'")
        return float(text)
    if not _INTEGER.fullmatch(text):
        raise LiteralError(at, f"expected an integer of type {kind}, got '{text}'")
    value = _integer(text)
    low, high = _RANGES[kind]
    if not low <= value <= high:
        raise _RangeError(at, f"{text} is outside the range of {kind} ({low} to {high})")
    return value


def _integer(text: str) -> int:
    digits = text.lstrip("+-")
    base = {"x": 16, "b": 2, "o": 8}.get(digits[1:2].lower(), 10)
    return int(text, base)
