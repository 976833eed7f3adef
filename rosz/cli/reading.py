"""Reading a sound command line, without typer.

Whatever is not plainly sound (a word too many, a value that is no number, ``--help``, letters of
options run together) is left to typer, which knows what to do with it or what to say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from rosz.cli.declare import App, Argument, Command, Context, Option

__all__ = ("Parameter", "options", "parameters", "read")

_END = "--"


class _Unsound(Exception):  # it never gets out of here
    """The line is none that can be read here."""


class Parameter:
    """One argument of a command's function.

    Args:
        name: Of the argument.
        kind: Type of a value: `str`, `int`, `float` or `bool`, or `Context`.
        mark: What it is on the command line; None for a context.
        many: Whether it takes several values.
        required: Whether it has to be given.
        default: What it is when it is not given.
    """

    __slots__ = ("default", "kind", "many", "mark", "name", "required")

    def __init__(
        self,
        name: str,
        kind: Callable[[str], Any],
        mark: Argument | Option | None,
        *,
        many: bool,
        required: bool,
        default: Any = None,
    ) -> None:
        self.default = default
        self.name = name
        self.kind = kind
        self.mark = mark
        self.many = many
        self.required = required


def read(app: App, argv: Sequence[str]) -> Callable[[], Any] | None:
    """Return what a command line asks for, ready to be called; ``None`` where typer has to look.

    Args:
        app: The commands.
        argv: What follows the name of the app.
    """
    context, words = app.sorted_out(argv)
    name = words.pop(0) if app.text and words else ""
    command = app.commands.get(name)
    if command is None:
        return None
    try:
        values = _Line(command).values(words)
    except _Unsound:
        return None
    function = command.function
    for one in parameters(function):
        if one.kind is Context:
            values[one.name] = context
    return lambda: function(**values)


def parameters(function: Callable[..., Any]) -> list[Parameter]:
    """Return the arguments of a command's function, in order."""
    code: Any = getattr(function, "__code__")  # noqa: B009  # which a Callable need not have
    names = code.co_varnames[: code.co_argcount]
    given = getattr(function, "__defaults__") or ()  # noqa: B009
    defaults: dict[str, Any] = dict(zip(names[len(names) - len(given) :], given, strict=True))
    defaults |= getattr(function, "__kwdefaults__") or {}  # noqa: B009
    hints = get_type_hints(function, include_extras=True)
    hints.pop("return", None)
    return [_parameter(name, hint, defaults) for name, hint in hints.items()]


def options(function: Callable[..., Any]) -> dict[str, Parameter]:
    """Return the options of a command's function by all their spellings."""
    return {
        spelling: one
        for one in parameters(function)
        if isinstance(one.mark, Option)
        for spelling in one.mark.spelled(one.name)
    }


def _parameter(name: str, hint: Any, defaults: Mapping[str, Any]) -> Parameter:
    mark = next(iter(getattr(hint, "__metadata__", ())), None)
    kind = hint if mark is None else hint.__origin__
    if get_origin(kind) in {Union, UnionType}:
        (kind,) = (one for one in get_args(kind) if one is not NoneType)
    many = get_origin(kind) is list
    return Parameter(
        name,
        get_args(kind)[0] if many else kind,
        mark,
        many=many,
        required=name not in defaults,
        default=defaults.get(name),
    )


class _Line:
    """Reads the words of one command.

    Args:
        command: Whose they are.
    """

    def __init__(self, command: Command) -> None:
        self._interspersed = command.interspersed
        self._options = options(command.function)
        self._arguments = [
            one for one in parameters(command.function) if isinstance(one.mark, Argument)
        ]
        self._values: dict[str, Any] = {}

    def values(self, words: Iterable[str]) -> dict[str, Any]:
        """Return the values by the names of their arguments; what is not given is left out."""
        positional: list[str] = []
        left = iter(words)
        for word in left:
            if word == _END:
                positional += left
            elif word.startswith("-") and word != "-":
                self._option(word, left)
            else:
                positional.append(word)
                if not self._interspersed:
                    positional += left
        self._place(positional)
        needed = {one.name for one in self._options.values() if one.required}
        if needed - self._values.keys():
            raise _Unsound
        return self._values

    def _option(self, word: str, left: Iterable[str]) -> None:
        name, given, text = word.partition("=") if word.startswith("--") else (word, "", "")
        one = self._options.get(name)
        if one is None or (given and one.kind is bool):
            raise _Unsound
        if one.kind is bool:
            self._values[one.name] = True
            return
        if not given:
            text = next(iter(left), _END)
            if text.startswith("-") and text != "-":
                raise _Unsound
        value = _value(one, text)
        if one.many:
            self._values.setdefault(one.name, []).append(value)
        else:
            self._values[one.name] = value

    def _place(self, words: list[str]) -> None:
        """Give the positional words to the arguments in turn; a list takes all that are left."""
        for one in self._arguments:
            if one.required and not words:
                raise _Unsound
            if one.many and words:
                self._values[one.name] = [_value(one, word) for word in words]
                words = []
            elif words:
                self._values[one.name] = _value(one, words[0])
                words = words[1:]
        if words:
            raise _Unsound


def _value(one: Parameter, word: str) -> Any:
    try:
        return one.kind(word)
    except ValueError:
        raise _Unsound from None
