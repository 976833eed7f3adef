"""Commands as they are declared: what each takes, and what help says of it.

A command is a function; annotations say which of its arguments are positional words and which are
options, as typer has it. But typer takes longer to load than most commands take to run. So a sound
command line is read by `rosz.cli.reading`, help is written by `rosz.cli.help`, and typer gets the
same declarations where what is wrong has to be explained (`rosz.cli.typed`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice
from typing import Any, TypeVar

__all__ = ("App", "Argument", "Command", "Context", "Option", "values_last")

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Argument:
    """A positional word, or several of them where the type is a list.

    Args:
        metavar: What help calls it.
        help: What help says of it.
    """

    __slots__ = ("help", "metavar")

    def __init__(self, *, metavar: str | None = None, help: str | None = None) -> None:  # noqa: A002  # as typer calls it
        self.metavar = metavar
        self.help = help


class Option:
    """An option; one of type `bool` takes no value.

    Args:
        names: How it is spelled; after its argument when not given.
        metavar: What help calls its value.
        help: What help says of it.
        hidden: Whether help leaves it out.
    """

    __slots__ = ("help", "hidden", "metavar", "names")

    def __init__(
        self,
        *names: str,
        metavar: str | None = None,
        help: str | None = None,  # noqa: A002  # as typer calls it
        hidden: bool = False,
    ) -> None:
        self.names = names
        self.metavar = metavar
        self.help = help
        self.hidden = hidden

    def spelled(self, argument: str) -> tuple[str, ...]:
        """Return all its spellings.

        Args:
            argument: The name of the argument that it is of.
        """
        return self.names or (f"--{argument.replace('_', '-')}",)


class Context:
    """What a command gets that asks for it.

    Args:
        argv: The remappings among the words of its line.
    """

    __slots__ = ("argv",)

    def __init__(self, argv: Sequence[str] = ()) -> None:
        self.argv = tuple(argv)


class Command:
    """One command.

    Args:
        function: What it does.
        help: What it is for; the function's docstring when not given.
        arrange: Puts its words into the order in which they are to be read.
        interspersed: Whether options may follow positional words.
        tolerant: Whether options that it does not have are positional words.
    """

    __slots__ = ("arrange", "function", "help", "interspersed", "tolerant")

    def __init__(
        self,
        function: Callable[..., Any],
        help: str | None,  # noqa: A002  # as typer calls it
        arrange: Callable[[list[str]], list[str]] | None,
        *,
        interspersed: bool,
        tolerant: bool,
    ) -> None:
        self.function = function
        self.help = help
        self.arrange = arrange
        self.interspersed = interspersed
        self.tolerant = tolerant


class App:
    """A command, or a group of commands, of ``rosz``.

    Args:
        text: What a group is for; empty for a lone command.
        remapped: Tells which words are remappings, wherever they stand.

    Attributes:
        commands: By name; the lone one by none.
    """

    def __init__(self, text: str = "", *, remapped: Callable[[str], bool] | None = None) -> None:
        self.text = text
        self.commands: dict[str, Command] = {}
        self._remapped = remapped

    def command(
        self,
        name: str = "",
        *,
        help: str | None = None,  # noqa: A002  # as typer calls it
        arrange: Callable[[list[str]], list[str]] | None = None,
        interspersed: bool = True,
        tolerant: bool = False,
    ) -> Callable[[_Function], _Function]:
        """Return what makes a function a command; the arguments are those of `Command`."""

        def declare(function: _Function) -> _Function:
            self.commands[name] = Command(
                function, help, arrange, interspersed=interspersed, tolerant=tolerant
            )
            return function

        return declare

    def sorted_out(self, argv: Sequence[str]) -> tuple[Context, list[str]]:
        """Return the remappings of a line, and its other words as they are to be read."""
        taken = self._remapped
        if taken is None:
            context, words = Context(), list(argv)
        else:
            context = Context([word for word in argv if taken(word)])
            words = [word for word in argv if not taken(word)]
        head = 1 if self.text else 0
        command = self.commands.get(words[0] if head and words else "")
        if command is not None and command.arrange is not None:
            words[head:] = command.arrange(words[head:])
        return context, words


def values_last(taking: frozenset[str]) -> Callable[[list[str]], list[str]]:
    """Return what moves options to the front, so that ``-1`` is a value and no option.

    Args:
        taking: The options that a value follows.
    """

    def arrange(args: list[str]) -> list[str]:
        options: list[str] = []
        values: list[str] = []
        words = iter(args)
        for word in words:
            if word == "--":
                values += words
            elif word in taking:
                options += [word, *islice(words, 1)]
            elif word.startswith("-") and word != "-" and not word[1:2].isdigit():
                options.append(word)
            else:
                values.append(word)
        return [*options, "--", *values]

    return arrange
