"""Read a sound command line from the declarations of its command, without typer.

All other lines (an unknown option, a missing argument, ``--help``, letters of options run together)
are left to typer, which knows what they mean or what is wrong with them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rosz.cli.declare import App, Argument, Command, Parameter

__all__ = ("read",)

_END_OF_OPTIONS = "--"


class _NotSound(Exception):  # it does not leave this module
    """The command line has to be read by typer."""


def read(app: App, argv: Sequence[str]) -> Callable[[], Any] | None:
    """Return a function that runs a command line; ``None`` if typer has to read it.

    Args:
        app: The commands.
        argv: The words that follow the name of the app.
    """
    remappings, words = app.split(argv)
    name = words.pop(0) if app.help and words else ""
    command = app.commands.get(name)
    if command is None:
        return None
    try:
        values = _Reader(command).values(words, remappings)
    except _NotSound:
        return None
    return lambda: command.function(**values)


class _Reader:
    """Reads the words of one command.

    Args:
        command: The command.
    """

    def __init__(self, command: Command) -> None:
        self._interspersed = command.interspersed
        self._parameters = command.parameters()
        self._options = {word: one for one in self._parameters for word in one.spellings}
        self._values: dict[str, Any] = {}

    def values(self, words: Sequence[str], remappings: Sequence[str]) -> dict[str, Any]:
        """Return the values of the parameters that are given, by name.

        Args:
            words: The words that follow the name of the command.
            remappings: The remappings of the command line.

        Raises:
            _NotSound: Typer has to read the words.
        """
        positional: list[str] = []
        left = iter(words)
        for word in left:
            if word == _END_OF_OPTIONS:
                positional += left
            elif word.startswith("-") and word != "-":
                self._read_option(word, left)
            else:
                positional.append(word)
                if not self._interspersed:
                    positional += left
        self._assign(positional)
        for one in self._parameters:
            if one.mark is None:
                self._values[one.name] = one.kind(remappings)
            elif one.required and one.name not in self._values:
                raise _NotSound
        return self._values

    def _read_option(self, word: str, left: Iterator[str]) -> None:
        name, given, text = word.partition("=") if word.startswith("--") else (word, "", "")
        one = self._options.get(name)
        if one is None or (given and one.kind is bool):
            raise _NotSound
        if one.kind is bool:
            self._values[one.name] = True
            return
        if not given:
            text = next(left, _END_OF_OPTIONS)
            if text.startswith("-") and text != "-":
                raise _NotSound
        value = _convert(one, text)
        if one.many:
            self._values.setdefault(one.name, []).append(value)
        else:
            self._values[one.name] = value

    def _assign(self, words: list[str]) -> None:
        """Assign positional words to the arguments in turn; a list takes all that are left."""
        for one in self._parameters:
            if not words:
                return
            if not isinstance(one.mark, Argument):
                continue
            if one.many:
                self._values[one.name] = [_convert(one, word) for word in words]
                return
            self._values[one.name] = _convert(one, words[0])
            words = words[1:]
        if words:
            raise _NotSound


def _convert(one: Parameter, word: str) -> Any:
    try:
        return one.kind(word)
    except ValueError:
        raise _NotSound from None
