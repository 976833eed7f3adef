"""The grammar of .msg, .srv and .action texts, ROS 1's and ROS 2's together.

A line is blank, a comment, a constant ``TYPE NAME=VALUE``, or a field ``TYPE NAME [DEFAULT]``.
Type names are resolved as far as one text allows: ``time``, ``duration`` and ``Header`` stand for
the types they mean, and a bare name for a type of the same package. The catalog checks that the
types exist.
"""

from __future__ import annotations

import re
from typing import NoReturn

from rosz.errors import DefinitionError
from rosz.idl.spec import (
    PRIMITIVES,
    ActionSpec,
    Constant,
    Field,
    FieldType,
    MessageSpec,
    Scalar,
    ServiceSpec,
    Shape,
    Value,
)

__all__ = ("parse_action", "parse_message", "parse_service")

_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?:/[A-Za-z][A-Za-z0-9_]*)*")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_WORD = re.compile(r"[^\s#=]+")
_DIGITS = re.compile(r"[0-9]+", re.ASCII)
_BLANK = re.compile(r"[ \t]*")
_SEPARATOR = "---"
_MOST = (1 << 32) - 1
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

_MEANING = {
    "time": "builtin_interfaces/msg/Time",
    "duration": "builtin_interfaces/msg/Duration",
    "Header": "std_msgs/msg/Header",
    "roslib/Header": "std_msgs/msg/Header",
}


def parse_message(name: str, text: str, path: str = "<string>") -> MessageSpec:
    """Read a .msg text.

    Args:
        name: Full name of the type, ``std_msgs/msg/String``.
        text: The definition.
        path: Path that it was read from, for errors.

    Raises:
        DefinitionError: The text does not follow the grammar.
    """
    lines = _lines(text)
    for number, line in enumerate(lines, 1):
        if line.startswith(_SEPARATOR):
            raise DefinitionError(
                "'---' has no meaning in a message; a service belongs in a .srv file",
                path,
                number,
                1,
            )
    return _message(name, lines, 1, text, path)


def parse_service(name: str, text: str, path: str = "<string>") -> ServiceSpec:
    """Read a .srv text: a request, ``---``, a response.

    Args:
        name: Full name of the type, ``std_srvs/srv/SetBool``.
        text: The definition.
        path: Path that it was read from, for errors.

    Raises:
        DefinitionError: The text does not follow the grammar.
    """
    first, second = _split(text, path, 1, "a service", "a request and a response")
    request = _message(f"{name}_Request", first[1], first[0], "\n".join(first[1]), path)
    response = _message(f"{name}_Response", second[1], second[0], "\n".join(second[1]), path)
    return ServiceSpec(name, request, response, text, path)


def parse_action(name: str, text: str, path: str = "<string>") -> ActionSpec:
    """Read an .action text: a goal, ``---``, a result, ``---``, a feedback.

    Args:
        name: Full name of the type, ``example_interfaces/action/Fibonacci``.
        text: The definition.
        path: Path that it was read from, for errors.

    Raises:
        DefinitionError: The text does not follow the grammar.
    """
    parts = _split(text, path, 2, "an action", "a goal, a result and a feedback")
    goal, result, feedback = (
        _message(f"{name}_{role}", lines, start, "\n".join(lines), path)
        for role, (start, lines) in zip(("Goal", "Result", "Feedback"), parts, strict=True)
    )
    return ActionSpec(name, goal, result, feedback, text, path)


def _lines(text: str) -> list[str]:
    return text.removeprefix("\ufeff").replace("\r\n", "\n").split("\n")


def _split(
    text: str, path: str, separators: int, what: str, parts: str
) -> list[tuple[int, list[str]]]:
    """Cut a text at its ``---`` lines into (number of the first line, lines)."""
    found: list[tuple[int, list[str]]] = [(1, [])]
    for number, line in enumerate(_lines(text), 1):
        if not line.startswith(_SEPARATOR):
            found[-1][1].append(line)
            continue
        if len(found) > separators:
            raise DefinitionError(f"one '---' too many: {what} has {parts}", path, number, 1)
        found.append((number + 1, []))
    if len(found) <= separators:
        last = len(found[-1][1]) + found[-1][0] - 1
        raise DefinitionError(f"expected '---': {what} has {parts}", path, last, 1)
    return found


def _message(name: str, lines: list[str], start: int, text: str, path: str) -> MessageSpec:
    fields: list[Field] = []
    constants: list[Constant] = []
    taken: dict[str, int] = {}
    for number, line in enumerate(lines, start):
        parsed = _Line(line.rstrip("\r"), number, path, name.partition("/")[0]).parse()
        if parsed is None:
            continue
        if parsed.name in taken:
            raise DefinitionError(
                f"'{parsed.name}' is already declared in line {taken[parsed.name]}",
                path,
                number,
                _name_column(line, parsed.name),
            )
        taken[parsed.name] = number
        if isinstance(parsed, Constant):
            constants.append(parsed)
        else:
            fields.append(parsed)
    return MessageSpec(name, tuple(fields), tuple(constants), text, path)


def _name_column(line: str, name: str) -> int:
    """Return the 1-based column of the name that a line declares."""
    found = re.search(rf"[ \t]({re.escape(name)})\b", line)
    return found.start(1) + 1 if found else 0


class _Line:
    """One line, and the offset up to which it has been read."""

    def __init__(self, text: str, number: int, path: str, package: str) -> None:
        self._text = text
        self._number = number
        self._path = path
        self._package = package
        self._at = 0

    def _fail(self, reason: str, at: int | None = None) -> NoReturn:
        column = (self._at if at is None else at) + 1
        raise DefinitionError(reason, self._path, self._number, column)

    def _skip(self) -> bool:
        """Skip blanks, and return whether there were any."""
        before = self._at
        match = _BLANK.match(self._text, before)
        self._at = match.end() if match else before
        return self._at > before

    def _done(self) -> bool:
        """Return whether nothing but a comment is left."""
        return self._at >= len(self._text) or self._text[self._at] == "#"

    def _rest(self) -> str:
        word = _WORD.match(self._text, self._at)
        return word[0] if word else self._text[self._at : self._at + 1]

    def parse(self) -> Field | Constant | None:
        """Return what the line declares, if anything."""
        self._skip()
        if self._done() or self._text.startswith("@key", self._at):
            return None
        column = self._at + 1
        kind = self._type()
        if not self._skip() and not self._done():
            self._fail(f"expected a blank between type and name, got '{self._rest()}'")
        if self._done():
            self._fail(f"expected a name after type '{kind.written}{kind.suffix}'")
        name = self._name()
        spaced = self._skip()
        if self._text.startswith("=", self._at):
            return self._constant(kind, name, column)
        default = None
        if not self._done():
            if not spaced:
                self._fail(
                    f"character '{self._text[self._at]}' in name; expected letters, digits or '_'"
                )
            default = self._default(kind)
        return Field(name, kind, default, self._number, column)

    def _type(self) -> FieldType:
        start = self._at
        match = _TYPE.match(self._text, start)
        if match is None:
            self._fail(f"expected a type, got '{self._rest()}'")
        written = match[0]
        self._at = match.end()
        base = self._resolve(written, start)
        bound = self._bound(base)
        shape, size = self._array()
        written += f"<={bound}" if bound else ""
        return FieldType(base, bound, shape, size, written)

    def _resolve(self, written: str, start: int) -> str:
        if written in PRIMITIVES:
            return written
        if written in _MEANING:
            return _MEANING[written]
        parts = written.split("/")
        if self._text.startswith("/", self._at):
            self._fail(f"expected a type's name after '{written}/'", self._at + 1)
        if len(parts) == 1:
            return f"{self._package}/msg/{written}"
        if len(parts) == 2:  # noqa: PLR2004  # package/Name
            return f"{parts[0]}/msg/{parts[1]}"
        if len(parts) == 3 and parts[1] in ("msg", "action"):  # noqa: PLR2004  # package/msg/Name
            return written
        return self._fail(
            f"expected a type such as 'pkg/Name' or 'pkg/msg/Name', got '{written}'", start
        )

    def _bound(self, base: str) -> int:
        if not self._text.startswith("<", self._at):
            return 0
        if base not in ("string", "wstring"):
            self._fail(f"only strings have a bound '<=N'; write '{base}[<=N]' for a sequence")
        if not self._text.startswith("<=", self._at):
            self._fail(f"expected '<=' and a number, got '{self._rest()}'")
        self._at += 2
        return self._size("bound of a string")

    def _array(self) -> tuple[Shape, int]:
        if not self._text.startswith("[", self._at):
            return "one", 0
        opened = self._at
        self._at += 1
        shape: Shape = "sequence"
        size = 0
        if self._text.startswith("<=", self._at):
            self._at += 2
            shape = "bounded"
            size = self._size("bound of a sequence")
        elif not self._text.startswith("]", self._at):
            shape = "fixed"
            size = self._size("size of an array")
        if not self._text.startswith("]", self._at):
            self._fail("the array's '[' is not closed; expected ']'", opened)
        self._at += 1
        if self._text.startswith("[", self._at):
            self._fail("arrays have one dimension; wrap the inner one in a message")
        return shape, size

    def _size(self, what: str) -> int:
        digits = _DIGITS.match(self._text, self._at)
        if digits is None:
            got = self._rest() or "nothing"
            self._fail(f"expected a number as {what}, got '{got}'")
        size = int(digits[0])
        if not 1 <= size <= _MOST:
            self._fail(f"expected a {what} from 1 to {_MOST}, got {digits[0]}")
        self._at = digits.end()
        return size

    def _name(self) -> str:
        match = _NAME.match(self._text, self._at)
        if match is None:
            self._fail(f"expected a name that begins with a letter, got '{self._rest()}'")
        end = match.end()
        if end < len(self._text) and self._text[end] not in " \t=#":
            bad = self._text[end]
            hint = "; the array part belongs to the type" if bad == "[" else ""
            self._fail(
                f"character '{bad}' in name '{match[0]}'; expected letters, digits or '_'{hint}",
                end,
            )
        self._at = end
        return match[0]

    def _constant(self, kind: FieldType, name: str, column: int) -> Constant:
        if not kind.primitive or kind.shape != "one":
            self._fail(
                f"a constant has a primitive type; '{kind.written}{kind.suffix}' is not one",
                column - 1,
            )
        try:
            value, text = _read_constant(kind.base, self._text, self._at + 1)
        except _LiteralError as error:
            self._fail(str(error), error.offset)
        return Constant(name, kind.base, value, text)

    def _default(
        self, kind: FieldType
    ) -> bool | int | float | str | tuple[bool | int | float | str, ...]:
        if not kind.primitive:
            self._fail(
                f"only fields of primitive types have defaults; '{kind.written}' is a message"
            )
        try:
            value, self._at = _read_default(kind, self._text, self._at)
        except _LiteralError as error:
            self._fail(str(error), error.offset)
        self._skip()
        if not self._done():
            self._fail(f"expected the end of the line after the default, got '{self._rest()}'")
        return value


class _LiteralError(Exception):
    """A value that does not fit its type; it becomes a DefinitionError with a place.

    Attributes:
        offset: Offset of the value in the line.
    """

    def __init__(self, offset: int, reason: str) -> None:
        self.offset = offset
        super().__init__(reason)


class _RangeError(_LiteralError):
    """A number of the right kind that is too large or too small."""


def _read_constant(kind: str, line: str, start: int) -> tuple[Scalar, str]:
    """Read the value of a constant: what is right of its ``=``.

    Args:
        kind: Name of the constant's type.
        line: The whole line.
        start: Offset of the value.

    Returns:
        The value, and its text, which ROS 1 hashes.

    Raises:
        _LiteralError: The text is not a value of the type.
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


def _read_default(field: FieldType, line: str, start: int) -> tuple[Value, int]:
    """Read the default of a field.

    Returns:
        The value, and the offset of its end.

    Raises:
        _LiteralError: The text is not a value of the type.
    """
    if field.shape != "one":
        return _list(field, line, start)
    if field.base in ("string", "wstring"):
        value, end = _text(line, start, _BARE_TEXT)
        _check_bound(field, value, start)
        return value, end
    bare = _BARE.match(line, start)
    if bare is None:
        raise _LiteralError(start, f"expected a default of type {field.base}")
    try:
        return _scalar(field.base, bare[0], start), bare.end()
    except _RangeError:
        raise
    except _LiteralError as error:
        reason = f"expected a default of type {field.base}, or a comment after '#', got '{bare[0]}'"
        raise _LiteralError(start, reason) from error


def _list(field: FieldType, line: str, start: int) -> tuple[Value, int]:
    if not line.startswith("[", start):
        raise _LiteralError(
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
        raise _LiteralError(start, f"expected {field.size} elements, got {len(values)}")
    if field.shape == "bounded" and len(values) > field.size:
        raise _LiteralError(start, f"expected at most {field.size} elements, got {len(values)}")
    return tuple(values), at + 1


def _unclosed(line: str, start: int, at: int) -> NoReturn:
    if at >= len(line) or line[at] == "#":
        raise _LiteralError(start, "the list is not closed; expected ']'")
    raise _LiteralError(at, f"expected ',' or ']' in the list, got '{line[at]}'")


def _element(field: FieldType, line: str, at: int) -> tuple[Scalar, int]:
    if field.base in ("string", "wstring"):
        value, end = _text(line, at, _BARE)
        _check_bound(field, value, at)
        return value, end
    bare = _BARE.match(line, at)
    if bare is None:
        if at >= len(line) or line[at] == "#":
            raise _LiteralError(at, "the list is not closed; expected ']'")
        raise _LiteralError(at, f"expected a value of type {field.base}, got '{line[at]}'")
    return _scalar(field.base, bare[0], at), bare.end()


def _text(line: str, at: int, bare: re.Pattern[str]) -> tuple[str, int]:
    if line[at : at + 1] in ("'", '"'):
        quoted = _QUOTED.match(line, at)
        if quoted is None:
            raise _LiteralError(at, f"the string is not closed; expected {line[at]}")
        return _unquote(quoted[0]), quoted.end()
    plain = bare.match(line, at)
    if plain is None:
        raise _LiteralError(at, "expected a string")
    return plain[0], plain.end()


def _check_bound(field: FieldType, value: str, at: int) -> None:
    if field.bound and len(value.encode()) > field.bound:
        raise _LiteralError(at, f"'{value}' is longer than the {field.bound} bytes of its type")


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
        raise _LiteralError(at, f"expected a value of type {kind}")
    if kind == "bool":
        if text.lower() not in _BOOLEANS:
            raise _LiteralError(at, f"expected true or false, got '{text}'")
        return _BOOLEANS[text.lower()]
    if kind in ("float32", "float64"):
        if _INTEGER.fullmatch(text):
            return float(_integer(text))
        if not _FLOAT.fullmatch(text):
            raise _LiteralError(at, f"expected a number of type {kind}, got '{text}'")
        return float(text)
    if not _INTEGER.fullmatch(text):
        raise _LiteralError(at, f"expected an integer of type {kind}, got '{text}'")
    value = _integer(text)
    low, high = _RANGES[kind]
    if not low <= value <= high:
        raise _RangeError(at, f"{text} is outside the range of {kind} ({low} to {high})")
    return value


def _integer(text: str) -> int:
    digits = text.lstrip("+-")
    base = {"x": 16, "b": 2, "o": 8}.get(digits[1:2].lower(), 10)
    return int(text, base)
