"""Read a simple command line from the declarations of its command, without typer.

All other lines (an unknown option, a missing argument, ``--help``, letters of options run together)
are left to typer, which knows their meaning or explains their faults.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from rosz.cli.declare import App, Argument, Command, CommandParameter

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
    if any(parameter.required and parameter.name not in values for parameter in parameters):
        return None
    return partial(command.run, values, remappings)


def _read_options(
    command: Command,
    parameters: Sequence[CommandParameter],
    words: Sequence[str],
    values: dict[str, Any],
) -> list[str]:
    """Read the options among the words into values, and return the positional words."""
    options = {word: parameter for parameter in parameters for word in parameter.spellings}
    positional: list[str] = []
    left = iter(words)
    for word in left:
        if word == _END_OF_OPTIONS:
            positional += left
        elif word.startswith("-") and word != "-":
            name, given, text = word.partition("=") if word.startswith("--") else (word, "", "")
            parameter = options.get(name)
            if parameter is None:
                raise _NotSimple
            _read_option(parameter, text if given else None, left, values)
        else:
            positional.append(word)
            if not command.interspersed:
                positional += left
    return positional


def _read_option(
    parameter: CommandParameter, text: str | None, left: Iterator[str], values: dict[str, Any]
) -> None:
    if parameter.kind is bool:
        if text is not None:
            raise _NotSimple
        values[parameter.name] = True
        return
    if text is None:
        text = next(left, _END_OF_OPTIONS)
        if text.startswith("-") and text != "-":
            raise _NotSimple
    value = _convert(parameter, text)
    if parameter.many:
        values.setdefault(parameter.name, []).append(value)
    else:
        values[parameter.name] = value


def _assign(
    parameters: Sequence[CommandParameter], words: Sequence[str], values: dict[str, Any]
) -> None:
    """Assign positional words to the arguments in turn; a list takes all that are left."""
    for parameter in parameters:
        if words and isinstance(parameter.mark, Argument):
            taken = words if parameter.many else words[:1]
            converted = [_convert(parameter, word) for word in taken]
            values[parameter.name] = converted if parameter.many else converted[0]
            words = words[len(taken) :]
    if words:
        raise _NotSimple


def _convert(parameter: CommandParameter, word: str) -> Any:
    try:
        return parameter.kind(word)
    except ValueError:
        raise _NotSimple from None
