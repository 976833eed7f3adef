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
    is_service_message,
)
from rosz.message import INTEGER_RANGES

_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?:/[A-Za-z][A-Za-z0-9_]*)*")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_WORD = re.compile(r"[^\s#=]+")
_TYPE_WORD = re.compile(r"([^\s#]*)(?:[ \t]+([A-Za-z][A-Za-z0-9_]*))?")
_DIGITS = re.compile(r"[0-9]+", re.ASCII)
_SURROGATE = re.compile(r"[\ud800-\udfff]")
_BLANK = re.compile(r"[ \t]*")
_KEY = re.compile(r"@key\b[ \t]*")
_SEPARATOR = "---"
_LONGEST_INTEGER = 80  # characters; 64 binary digits are fewer
_MOST = (1 << 32) - 1
_INTEGER = re.compile(r"[+-]?(?:0[xX][0-9a-fA-F]+|0[bB][01]+|0[oO][0-7]+|[0-9]+)")
_FLOAT = re.compile(
    r"(?i)[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?|inf(?:inity)?|nan)", re.ASCII
)
_QUOTED = re.compile(r"""'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*\"""")
_BARE = re.compile(r"[^\s,\]#]+")
_BARE_TEXT = re.compile(r"[^#]*[^#\s]")
_ESCAPE = re.compile(r"\\(?:u([0-9a-fA-F]{4})|x([0-9a-fA-F]{2})|(.))")
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "0": "\0", "a": "\a", "b": "\b", "f": "\f", "v": "\v"}
_BOOLEANS = {"true": True, "false": False, "1": True, "0": False}
_TOO_LARGE = {"float32": 2.0**128 - 2.0**103, "float64": float("inf")}
_STRINGS = ("string", "wstring")

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
    _check_name(name, path)
    lines = _lines(text)
    for number, line in enumerate(lines, 1):
        if line.startswith(_SEPARATOR):
            reason = "'---' has no meaning in a message; a service belongs in a .srv file"
            raise DefinitionError(reason, path, number, 1)
    return _message(name, lines, 1, text, path)


def parse_service(name: str, text: str, path: str = "<string>") -> ServiceSpec:
    """Read a .srv text: a request, ``---``, a response.

    Without a ``---`` the response is empty, as genpy has it.

    Args:
        name: Full name of the type, ``std_srvs/srv/SetBool``.
        text: The definition.
        path: Path that it was read from, for errors.

    Raises:
        DefinitionError: The text does not follow the grammar.
    """
    what = "a service has a request and a response"
    if not any(line.startswith(_SEPARATOR) for line in _lines(text)):
        request = _split(name, ("Request",), text, path, what)[0]
        response = MessageSpec(f"{name}_Response", (), path=path)
        return ServiceSpec(name, request, response, text, path)
    request, response = _split(name, ("Request", "Response"), text, path, what)
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
    what = "an action has a goal, a result and a feedback"
    goal, result, feedback = _split(name, ("Goal", "Result", "Feedback"), text, path, what)
    return ActionSpec(name, goal, result, feedback, text, path)


def _check_name(name: str, path: str) -> None:
    base = name.rpartition("/")[2]
    if not _NAME.fullmatch(base):
        raise DefinitionError(
            f"'{base}' cannot name a type; expected a letter first, then letters, digits or '_'",
            path,
        )


def _lines(text: str) -> list[str]:
    return text.removeprefix("\ufeff").replace("\r\n", "\n").split("\n")


def _split(name: str, roles: tuple[str, ...], text: str, path: str, what: str) -> list[MessageSpec]:
    """Return the messages in a text, which ``---`` lines separate."""
    _check_name(name, path)
    parts: list[tuple[int, list[str]]] = [(1, [])]
    for number, line in enumerate(_lines(text), 1):
        if not line.startswith(_SEPARATOR):
            parts[-1][1].append(line)
            continue
        if len(parts) == len(roles):
            raise DefinitionError(f"one '---' too many: {what}", path, number, 1)
        parts.append((number + 1, []))
    if len(parts) < len(roles):
        start, lines = parts[-1]
        raise DefinitionError(f"expected '---': {what}", path, start + len(lines) - 1, 1)
    return [
        _message(f"{name}_{role}", lines, start, "\n".join(lines), path)
        for role, (start, lines) in zip(roles, parts, strict=True)
    ]


def _message(name: str, lines: list[str], start: int, text: str, path: str) -> MessageSpec:
    fields: list[Field] = []
    constants: list[Constant] = []
    taken: dict[str, int] = {}
    for number, line in enumerate(lines, start):
        parsed = _DefinitionLine(line.rstrip("\r"), number, path, name.partition("/")[0]).parse()
        if parsed is None:
            continue
        if parsed.name in taken:
            raise DefinitionError(
                f"'{parsed.name}' is already declared in line {taken[parsed.name]}",
                path,
                number,
                _column(line, parsed.name),
            )
        taken[parsed.name] = number
        if isinstance(parsed, Constant):
            constants.append(parsed)
        else:
            fields.append(parsed)
    return MessageSpec(name, tuple(fields), tuple(constants), text, path)


def _column(line: str, name: str) -> int:
    """Return the 1-based column of the name that a line declares."""
    match = re.search(rf"\S[ \t]+({re.escape(name)})\b", line)
    return match.start(1) + 1 if match else 0


class _DefinitionLine:
    """One line, and the offset up to which it has been read."""

    def __init__(self, text: str, number: int, path: str, package: str) -> None:
        self._text = text
        self._number = number
        self._path = path
        self._package = package
        self._at = 0
        self._subject = ""

    def _fail(self, reason: str, at: int | None = None) -> NoReturn:
        column = (self._at if at is None else at) + 1
        raise DefinitionError(self._subject + reason, self._path, self._number, column)

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
        """Return the field or constant of the line; None if it has none."""
        self._skip()
        if key := _KEY.match(self._text, self._at):
            self._at = key.end()
        if self._done():
            return None
        column = self._at + 1
        kind = self._type()
        if not self._skip() and not self._done():
            self._fail(f"expected a blank between type and name, got '{self._rest()}'")
        self._subject = ""
        if self._done():
            self._fail(f"expected a name after type '{kind.written}{kind.suffix}'")
        name = self._name()
        self._skip()
        constant = self._text.startswith("=", self._at)
        self._subject = f"{'constant' if constant else 'field'} '{name}': "
        if constant:
            return self._constant(kind, name, column)
        default = None if self._done() else self._default(kind)
        return Field(name, kind, default, self._number, column)

    def _type(self) -> FieldType:
        start = self._at
        match = _TYPE.match(self._text, start)
        if match is None:
            self._fail(f"expected a type, got '{self._rest()}'")
        written = match[0]
        self._subject = self._shown_type(start)
        self._at = match.end()
        base = self._resolve(written, start)
        bound = self._bound(base)
        shape, size = self._array()
        written += f"<={bound}" if bound else ""
        return FieldType(base, bound, shape, size, written)

    def _shown_type(self, start: int) -> str:
        """Return the beginning of an error about a type: its whole word, and the field's name."""
        match = _TYPE_WORD.match(self._text, start)
        word, name = (match[1], match[2]) if match else ("", None)
        return f"type '{word}' of '{name}': " if name else f"type '{word}': "

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
        if len(parts) == 3 and (  # noqa: PLR2004  # package/msg/Name
            parts[1] in ("msg", "action") or is_service_message(written)
        ):
            return written
        return self._fail("expected a type such as 'pkg/Name' or 'pkg/msg/Name'", start)

    def _bound(self, base: str) -> int:
        if not self._text.startswith("<", self._at):
            return 0
        if base not in _STRINGS:
            self._fail(f"only strings have a bound '<=N'; write '{base}[<=N]' for a sequence")
        if not self._text.startswith("<=", self._at):
            self._fail("expected '<=' and a number as bound")
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
            self._fail(f"expected a number as {what}")
        size = int(digits[0].lstrip("0")[:_LONGEST_INTEGER] or "0")
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
            word = match[0] + self._text[end:].split()[0].partition("#")[0]
            hint = "; the array part belongs to the type" if bad == "[" else ""
            self._fail(
                f"character '{bad}' in name '{word}'; expected letters, digits or '_'{hint}",
                end,
            )
        self._at = end
        return match[0]

    def _constant(self, kind: FieldType, name: str, column: int) -> Constant:
        if not kind.primitive or kind.shape != "one":
            self._fail(
                f"its type has to be a primitive one; '{kind.written}{kind.suffix}' is not",
                column - 1,
            )
        if kind.bound:
            self._fail(
                f"only fields have bounded strings; write '{kind.base}' for '{kind.written}'",
                column - 1,
            )
        self._at += 1
        text = self._text[self._at :]
        if kind.base in _STRINGS:
            # ROS 1 takes the rest of the line, quotes and # included; ROS 2 quotes its strings.
            text = text.strip()
            quoted = _QUOTED.match(text)
            if quoted and text[quoted.end() :].lstrip()[:1] in ("", "#"):
                return Constant(name, kind.base, self._checked(_unquote(quoted[0])), text)
            return Constant(name, kind.base, self._checked(text), text)
        text = text.partition("#")[0]
        self._at += len(text) - len(text.lstrip())
        text = text.strip()
        return Constant(name, kind.base, self._scalar(kind.base, text), text)

    def _default(self, kind: FieldType) -> Value:
        if not kind.primitive:
            self._fail(
                f"only fields of primitive types have defaults; '{kind.written}' is a message"
            )
        value = self._one_default(kind) if kind.shape == "one" else self._list(kind)
        self._skip()
        if not self._done():
            self._fail(f"expected the end of the line after the default, got '{self._rest()}'")
        return value

    def _one_default(self, kind: FieldType) -> Scalar:
        if kind.base in _STRINGS:
            return self._string(kind, _BARE_TEXT)
        bare = _BARE.match(self._text, self._at)
        expected = f"expected a default of type {kind.base}"
        if bare is None:
            self._fail(expected)
        return self._bare(kind, bare, f"{expected}, or a comment after '#', got '{bare[0]}'")

    def _list(self, kind: FieldType) -> Value:
        start = self._at
        if not self._text.startswith("[", start):
            got = self._text[start:].strip()
            self._fail(f"expected a list '[…]' as default of an array, got '{got}'")
        values: list[Scalar] = []
        self._at += 1
        self._skip()
        while not self._text.startswith("]", self._at):
            if values:
                if self._done():
                    self._fail("the list is not closed; expected ']'", start)
                if self._text[self._at] != ",":
                    bare = _BARE.match(self._text, self._at)
                    got = bare[0] if bare else self._text[self._at]
                    self._fail(f"expected ',' or ']' in the list, got '{got}'")
                self._at += 1
                self._skip()
            values.append(self._element(kind))
            self._skip()
        if kind.shape == "fixed" and len(values) != kind.size:
            self._fail(f"expected {kind.size} elements, got {len(values)}", start)
        if kind.shape == "bounded" and len(values) > kind.size:
            self._fail(f"expected at most {kind.size} elements, got {len(values)}", start)
        self._at += 1
        return tuple(values)

    def _element(self, kind: FieldType) -> Scalar:
        if self._done():
            self._fail("the list is not closed; expected ']'")
        if kind.base in _STRINGS:
            return self._string(kind, _BARE)
        bare = _BARE.match(self._text, self._at)
        if bare is None:
            self._fail(f"expected a value of type {kind.base}, got '{self._text[self._at]}'")
        return self._bare(kind, bare)

    def _bare(self, kind: FieldType, bare: re.Match[str], wrong: str = "") -> Scalar:
        """Return a number as default; unlike a constant of ROS 1, it may not be too large."""
        value = self._scalar(kind.base, bare[0], wrong)
        too_large = isinstance(value, float) and abs(value) >= _TOO_LARGE[kind.base]
        if too_large and "n" not in bare[0].lower():  # inf, infinity
            self._fail(f"{bare[0]} is outside the range of {kind.base}")
        self._at = bare.end()
        return value

    def _string(self, kind: FieldType, bare: re.Pattern[str]) -> str:
        quote = self._text[self._at : self._at + 1]
        if quote in ("'", '"'):
            match = _QUOTED.match(self._text, self._at)
            if match is None:
                self._fail(f"the string is not closed; expected {quote}")
            value = self._checked(_unquote(match[0]))
        else:
            match = bare.match(self._text, self._at)
            if match is None:
                self._fail("expected a string")
            value = self._checked(match[0])
        if kind.bound and len(value.encode()) > kind.bound:
            self._fail(f"'{value}' is longer than the {kind.bound} bytes of its type")
        self._at = match.end()
        return value

    def _checked(self, value: str) -> str:
        """Return a string, which must be one that UTF-8 can encode."""
        surrogate = _SURROGATE.search(value)
        if surrogate is not None:
            self._fail(f"'\\u{ord(surrogate[0]):04x}' is half a character, which no string holds")
        return value

    def _scalar(self, kind: str, text: str, wrong: str = "") -> Scalar:
        """Return the value of a text; ``wrong`` is the error for a value of another kind."""
        if not text:
            self._fail(f"expected a value of type {kind}")
        if kind == "bool":
            if text.lower() not in _BOOLEANS:
                self._fail(wrong or f"expected true or false, got '{text}'")
            return _BOOLEANS[text.lower()]
        is_integer = _INTEGER.fullmatch(text)
        if kind in ("float32", "float64"):
            if _FLOAT.fullmatch(text):
                return float(text)
            if not is_integer or len(text) > _LONGEST_INTEGER:
                self._fail(wrong or f"expected a number of type {kind}, got '{text}'")
            return float(_integer(text))
        if not is_integer:
            self._fail(wrong or f"expected an integer of type {kind}, got '{text}'")
        low, high = INTEGER_RANGES[kind]
        value = _integer(text) if len(text) <= _LONGEST_INTEGER else high + 1
        if not low <= value <= high:
            self._fail(f"{text} is outside the range of {kind} ({low} to {high})")
        return value


def _unquote(text: str) -> str:
    def replace(escape: re.Match[str]) -> str:
        code = escape[1] or escape[2]
        return chr(int(code, 16)) if code else _ESCAPED.get(escape[3], escape[3])

    return _ESCAPE.sub(replace, text[1:-1])


def _integer(text: str) -> int:
    base = {"x": 16, "b": 2, "o": 8}.get(text.lstrip("+-")[1:2].lower(), 10)
    return int(text, base)
