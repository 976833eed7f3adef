"""Declarations of commands: what each command takes, and what its help says.

A command is a function. The annotations of its parameters say which are positional arguments and
which are options, as in typer. Typer takes longer to import than most commands take to run, so the
declarations do not need it: `rosz.cli.reading` reads a sound command line from them, and
`rosz.cli.typer_app` translates them for typer, which writes help and explains what is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, TypeVar, Union, get_args, get_origin, get_type_hints

if TYPE_CHECKING:
    from rosz.cli.suggest import Source

__all__ = ("App", "Argument", "Command", "Option", "Parameter", "values_last")

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Argument:
    """A positional argument; a parameter of a list type takes all words that are left.

    Args:
        metavar: The name in help.
        help: The description in help.
        autocompletion: The source of completions.
    """

    __slots__ = ("autocompletion", "help", "metavar")

    def __init__(
        self,
        metavar: str,
        *,
        help: str | None = None,  # noqa: A002  # as in typer
        autocompletion: Source | None = None,
    ) -> None:
        self.metavar = metavar
        self.help = help
        self.autocompletion = autocompletion


class Option:
    """An option; a parameter of type `bool` makes it a flag.

    Args:
        names: The spellings; ``--`` and the parameter's name when none is given.
        metavar: The name of the value in help.
        help: The description in help.
        hidden: Whether help and completion leave it out.
        autocompletion: The source of completions of the value.
    """

    __slots__ = ("autocompletion", "help", "hidden", "metavar", "names")

    def __init__(
        self,
        *names: str,
        metavar: str | None = None,
        help: str | None = None,  # noqa: A002  # as in typer
        hidden: bool = False,
        autocompletion: Source | None = None,
    ) -> None:
        self.names = names
        self.metavar = metavar
        self.help = help
        self.hidden = hidden
        self.autocompletion = autocompletion


class Parameter:
    """One parameter of a command's function.

    Args:
        name: Name of the parameter.
        kind: Type of one value: `str`, `int`, `float` or `bool`. A parameter without a mark has
            another type, which is called with the remappings of the command line.
        mark: The declaration; ``None`` for a parameter that is not on the command line.
        many: Whether it takes several values.
        required: Whether it must be given.
        default: The value when it is not given.
    """

    __slots__ = ("default", "kind", "many", "mark", "name", "required")

    def __init__(
        self,
        name: str,
        kind: Callable[[Any], Any],
        mark: Argument | Option | None,
        *,
        many: bool,
        required: bool,
        default: Any = None,
    ) -> None:
        self.name = name
        self.kind = kind
        self.mark = mark
        self.many = many
        self.required = required
        self.default = default

    @property
    def spellings(self) -> tuple[str, ...]:
        """The spellings of an option; empty for a positional argument."""
        if not isinstance(self.mark, Option):
            return ()
        return self.mark.names or (f"--{self.name.replace('_', '-')}",)


class Command:
    """One command.

    Args:
        function: The function that runs it.
        help: The description; the function's docstring when not given.
        arrange: A function that puts the words into the order in which they are read.
        interspersed: Whether options may follow positional arguments.
        tolerant: Whether unknown options count as positional arguments.
    """

    __slots__ = ("arrange", "function", "help", "interspersed", "tolerant")

    def __init__(
        self,
        function: Callable[..., Any],
        help: str | None,  # noqa: A002  # as in typer
        arrange: Callable[[list[str]], list[str]] | None,
        *,
        interspersed: bool,
        tolerant: bool,
    ) -> None:
        self.function = function
        self.help = help or function.__doc__ or ""
        self.arrange = arrange
        self.interspersed = interspersed
        self.tolerant = tolerant

    def parameters(self) -> list[Parameter]:
        """Return the parameters of the function, in order."""
        # inspect.signature would do the same, but inspect takes long to import.
        function: Any = self.function
        code = function.__code__
        names = code.co_varnames[: code.co_argcount]
        given = function.__defaults__ or ()
        defaults: dict[str, Any] = dict(zip(names[len(names) - len(given) :], given, strict=True))
        defaults |= function.__kwdefaults__ or {}
        hints = get_type_hints(function, include_extras=True)
        hints.pop("return", None)
        return [_parameter(name, hint, defaults) for name, hint in hints.items()]


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
        is_remapping: Callable[[str], bool] | None = None,
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
        """Return a decorator that declares a command; the arguments are those of `Command`."""

        def declare(function: _Function) -> _Function:
            self.commands[name] = Command(
                function, help, arrange, interspersed=interspersed, tolerant=tolerant
            )
            return function

        return declare

    def split(self, argv: Sequence[str]) -> tuple[list[str], list[str]]:
        """Return the remappings of a command line, and its other words in reading order."""
        test = self._is_remapping
        remappings = [] if test is None else [word for word in argv if test(word)]
        words = [word for word in argv if word not in remappings] if remappings else list(argv)
        head = 1 if self.help else 0
        command = self.commands.get(words[0] if head and words else "")
        if command is not None and command.arrange is not None:
            words[head:] = command.arrange(words[head:])
        return remappings, words


def values_last(with_value: frozenset[str]) -> Callable[[list[str]], list[str]]:
    """Return a function that moves options to the front, so that ``-1`` can be a value.

    Args:
        with_value: The options that a value follows.
    """

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
