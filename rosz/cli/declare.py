"""Declarations of commands: their arguments, options and help texts.

A command is a function. The annotations of its parameters say which are positional arguments and
which are options, as in typer. A parameter whose type is a `msgspec.Struct` stands for the fields
of the struct, which are declared in the same way: so a command has one parameter for many options.

Typer takes longer to import than most commands take to run, so the declarations do not need it:
`rosz.cli.reading` reads a sound command line from them, and `rosz.cli.typer_app` translates them
for typer, which writes help and explains faults of a line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import islice
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    NamedTuple,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.cli.suggest import Source

_Function = TypeVar("_Function", bound=Callable[..., Any])
_MOST = 1_000_000_000
_LONGEST = 1e9
_LATEST = 1e10
"""Thirty years. A longer time is a mistake, and more than some system clocks can hold."""


class Argument(NamedTuple):
    """A positional argument; a parameter of a list type takes all words that are left.

    Args:
        metavar: The name in help.
        source: The source of completions.
    """

    metavar: str
    help: str | None = None
    source: Source | None = None


class Option(NamedTuple):
    """An option; a parameter of type `bool` makes it a flag.

    Args:
        form: The spellings and the name of the value, such as ``-n --count COUNT``.
        help: The description in help; without one, help and completion leave the option out.
        source: The source of completions of the value.
    """

    form: str
    help: str | None = None
    source: Source | None = None

    @property
    def names(self) -> list[str]:
        """The spellings."""
        return [word for word in self.form.split() if word.startswith("-")]

    @property
    def metavar(self) -> str | None:
        """The name of the value in help."""
        return next((word for word in self.form.split() if not word.startswith("-")), None)


Json = Annotated[bool, Option("--json", "Print JSON.")]


class CommandParameter(NamedTuple):
    """One argument or option of a command.

    Args:
        kind: Type of one value: `str`, `int`, `float` or `bool`.
        many: Whether it takes several values.
    """

    name: str
    hint: Any
    kind: Callable[[Any], Any]
    mark: Argument | Option
    many: bool
    required: bool
    default: Any

    @property
    def spellings(self) -> list[str]:
        """The spellings of an option; empty for a positional argument."""
        return self.mark.names if isinstance(self.mark, Option) else []


class Command(NamedTuple):
    """One command.

    Args:
        arrange: A function that puts the words into the order in which they are read.
        interspersed: Whether options may follow positional arguments.
        tolerant: Whether unknown options count as positional arguments.
    """

    function: Callable[..., Any]
    help: str
    arrange: Callable[[list[str]], list[str]] | None
    interspersed: bool
    tolerant: bool

    def parameters(self) -> list[CommandParameter]:
        """Return the arguments and options, in order."""
        function: Any = self.function
        # inspect.signature would do the same, but inspect takes long to import.
        code = function.__code__
        names = code.co_varnames[: code.co_argcount]
        given = function.__defaults__ or ()
        defaults: dict[str, Any] = dict(zip(names[len(names) - len(given) :], given, strict=True))
        defaults |= function.__kwdefaults__ or {}
        parameters = []
        for name, hint in _hints(function).items():
            if hasattr(hint, "__metadata__"):
                default = defaults.get(name)
                parameters.append(_parameter(name, hint, default, required=name not in defaults))
            elif hasattr(hint, "__struct_fields__"):
                from msgspec.structs import fields

                for field in fields(hint):
                    default = None if field.required else field.default
                    parameters.append(
                        _parameter(field.name, field.type, default, required=field.required)
                    )
        return parameters

    def run(self, values: Mapping[str, Any], remappings: Sequence[str]) -> Any:
        """Call the function.

        Args:
            values: The values of those parameters and fields that are given, by name.
            remappings: The remappings of the command line. A parameter without a mark has a type
                that is called with them.
        """
        arguments: dict[str, Any] = {}
        for name, hint in _hints(self.function).items():
            if hasattr(hint, "__struct_fields__"):
                given = values.keys() & hint.__struct_fields__
                arguments[name] = hint(**{field: values[field] for field in given})
            elif not hasattr(hint, "__metadata__"):
                arguments[name] = hint(remappings)
            elif name in values:
                arguments[name] = values[name]
        return self.function(**arguments)


@cache
def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    hints = get_type_hints(function, include_extras=True)
    hints.pop("return", None)
    return hints


def _parameter(name: str, annotated: Any, default: Any, *, required: bool) -> CommandParameter:
    hint, mark = annotated.__origin__, annotated.__metadata__[0]
    kind = hint
    if get_origin(kind) in {Union, UnionType}:
        (kind,) = (member for member in get_args(kind) if member is not NoneType)
    many = get_origin(kind) is list
    kind = get_args(kind)[0] if many else kind
    return CommandParameter(name, hint, kind, mark, many, required, default)


class App:
    """A group of commands, or a command without a group, of ``rosz``.

    Args:
        help: The description of a group; empty for a command without a group.
        is_remapping: A function that tells which words are remappings, wherever they stand.

    Attributes:
        commands: The commands by name; the name is empty for a command without a group.
    """

    def __init__(
        self,
        help: str = "",  # noqa: A002  # as in typer
        *,
        is_remapping: Callable[[str], bool] = lambda _: False,
    ) -> None:
        self.help = help
        self.commands: dict[str, Command] = {}
        self._is_remapping = is_remapping

    def command(
        self,
        name: str = "",
        *,
        help: str | None = None,  # noqa: A002  # as in typer
        arrange: Callable[[list[str]], list[str]] | None = None,
        interspersed: bool = True,
        tolerant: bool = False,
    ) -> Callable[[_Function], _Function]:
        """Return a decorator that declares a command; the arguments are those of `Command`.

        The function's docstring is the description when none is given.
        """

        def declare(function: _Function) -> _Function:
            text = help or function.__doc__ or ""
            self.commands[name] = Command(function, text, arrange, interspersed, tolerant)
            return function

        return declare

    def split(self, argv: Sequence[str]) -> tuple[list[str], list[str]]:
        """Return the remappings of a command line, and its other words in reading order."""
        remappings = [word for word in argv if self._is_remapping(word)]
        words = [word for word in argv if word not in remappings]
        head = 1 if self.help else 0
        command = self.commands.get(words[0] if head and words else "")
        if command is not None and command.arrange is not None:
            words[head:] = command.arrange(words[head:])
        return remappings, words


def values_last(*with_value: str) -> Callable[[list[str]], list[str]]:
    """Return a function that moves options, some with a value, before values such as ``-1``."""

    def arrange(args: list[str]) -> list[str]:
        options: list[str] = []
        values: list[str] = []
        words = iter(args)
        for word in words:
            if word == "--":
                values += words
            elif word in with_value:
                options += [word, *islice(words, 1)]
            elif word.startswith("-") and word != "-" and not word[1:2].isdigit():
                options.append(word)
            else:
                values.append(word)
        return [*options, "--", *values]

    return arrange


def seconds(option: str, value: float) -> float:
    """Return a time limit in seconds, if it is in its bounds."""
    if not 0 < value <= _LONGEST:
        raise UsageError(f"{option} is {value:g}; expected seconds above 0, at most {_LONGEST:g}")
    return value


def no_less_than_zero(option: str, value: float | None) -> None:
    """Check that a time in seconds, if one is given, is in its bounds."""
    if value is not None and not 0 <= value <= _LATEST:
        raise UsageError(f"{option} is {value:g}; expected 0 or more seconds, at most {_LATEST:g}")


def per_second(option: str, value: float | None) -> None:
    """Check that a rate in hertz, if one is given, is in its bounds."""
    if value is not None and not 1 / _LONGEST <= value <= _MOST:
        raise UsageError(f"{option} is {value:g}; expected a rate above 0, at most {_MOST:g} Hz")


def at_least(option: str, value: int | None, fewest: int, what: str, most: int = _MOST) -> None:
    """Check that a number of things, if one is given, is in its bounds."""
    if value is not None and value < fewest:
        raise UsageError(f"{option} is {value}; expected {fewest} or more {what}")
    if value is not None and value > most:
        raise UsageError(f"{option} is {value}; expected at most {most} {what}")
