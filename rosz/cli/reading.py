"""Read a simple command line from the declarations of its command, without typer.

All other lines (an unknown option, a missing argument, ``--help``, letters of options run together)
are left to typer, which knows what they mean or what is wrong with them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rosz.cli.declare import App, Argument, Command, Parameter

__all__ = ("read",)

_END_OF_OPTIONS = "--"


class _NotSimple(Exception):  # it does not leave this module
    """The command line has to be read by typer."""


def read(app: App, argv: Sequence[str]) -> Callable[[], Any] | None:
    """Return a function that runs a command line; ``None`` if typer has to read it."""
    remappings, words = app.split(argv)
    command = app.commands.get(words.pop(0) if app.help and words else "")
    if command is None:
        return None
    parameters = command.parameters()
    values: dict[str, Any] = {}
    try:
        positional = _read_options(command, parameters, words, values)
        _assign(parameters, positional, values)
    except _NotSimple:
        return None
    for one in parameters:
        if one.mark is None:
            values[one.name] = one.kind(remappings)
        elif one.required and one.name not in values:
            return None
    return lambda: command.function(**values)


def _read_options(
    command: Command, parameters: Sequence[Parameter], words: Sequence[str], values: dict[str, Any]
) -> list[str]:
    """Read the options among the words into values, and return the positional words."""
    options = {word: one for one in parameters for word in one.spellings}
    positional: list[str] = []
    left = iter(words)
    for word in left:
        if word == _END_OF_OPTIONS:
            positional += left
        elif word.startswith("-") and word != "-":
            name, given, text = word.partition("=") if word.startswith("--") else (word, "", "")
            one = options.get(name)
            if one is None:
                raise _NotSimple
            _read_option(one, text if given else None, left, values)
        else:
            positional.append(word)
            if not command.interspersed:
                positional += left
    return positional


def _read_option(
    one: Parameter, text: str | None, left: Iterator[str], values: dict[str, Any]
) -> None:
    if one.kind is bool:
        if text is not None:
            raise _NotSimple
        values[one.name] = True
        return
    if text is None:
        text = next(left, _END_OF_OPTIONS)
        if text.startswith("-") and text != "-":
            raise _NotSimple
    value = _convert(one, text)
    if one.many:
        values.setdefault(one.name, []).append(value)
    else:
        values[one.name] = value


def _assign(parameters: Sequence[Parameter], words: Sequence[str], values: dict[str, Any]) -> None:
    """Assign positional words to the arguments in turn; a list takes all that are left."""
    for one in parameters:
        if words and isinstance(one.mark, Argument):
            taken = words if one.many else words[:1]
            found = [_convert(one, word) for word in taken]
            values[one.name] = found if one.many else found[0]
            words = words[len(taken) :]
    if words:
        raise _NotSimple


def _convert(one: Parameter, word: str) -> Any:
    try:
        return one.kind(word)
    except ValueError:
        raise _NotSimple from None
