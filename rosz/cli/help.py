"""What help says: of all commands, of a group, of one command; as wide as the terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosz.cli.declare import App, Command
    from rosz.cli.reading import Parameter

__all__ = ("asked_for", "overview")

_ASKING = frozenset({"-h", "--help"})
_HELP_ROW = ("-h, --help", "Show this message and exit.")
_NARROWEST, _USUAL, _WIDEST = 30, 80, 100
_WIDEST_LABEL = 26
"""A longer one has a line of its own."""


def overview(commands: Mapping[str, str]) -> str:
    """Return the help of the whole program.

    Args:
        commands: What each is for, by name.
    """
    return _group("rosz", (), commands.items())


def asked_for(app: App, argv: Sequence[str], program: str) -> str:
    """Return the help that a command line asks for; empty when it asks for none.

    Args:
        app: The commands.
        argv: What follows the name of the app.
        program: The name of the app, as it is typed.
    """
    _, words = app.sorted_out(argv)
    if not app.text:
        command = app.commands[""]
        return _of_command(command, program) if _asks(command, words) else ""
    if not words or words[0] in _ASKING:
        rows = ((name, _paragraphs(one)[0]) for name, one in app.commands.items())
        return _group(program, (app.text,), rows)
    found = app.commands.get(words[0])
    if found is None or not _asks(found, words[1:]):
        return ""
    return _of_command(found, f"{program} {words[0]}")


def _asks(command: Command, words: Sequence[str]) -> bool:
    """Tell whether help is among the words that are the command's own."""
    from rosz.cli.reading import options

    known = options(command.function)
    left = iter(words)
    for word in left:
        if word in _ASKING:
            return True
        if word == "--" or (not command.interspersed and not word.startswith("-")):
            return False
        if word in known and known[word].kind is not bool:
            next(left, None)
    return False


def _group(program: str, text: Sequence[str], rows: Iterable[tuple[str, str]]) -> str:
    usage = f"usage: {program} COMMAND [ARGUMENTS]"
    return _text(usage, text, list(rows), tail=f"{program} COMMAND --help tells more.")


def _of_command(command: Command, program: str) -> str:
    from rosz.cli.declare import Option
    from rosz.cli.reading import parameters

    shown = [one for one in parameters(command.function) if one.mark is not None]
    words = [one for one in shown if not isinstance(one.mark, Option)]
    usage = " ".join(["usage:", program, "[OPTIONS]", *map(_metavar, words)])
    named = [(_metavar(one), one.mark.help) for one in words if one.mark and one.mark.help]
    rows = [
        _option_row(one) for one in shown if isinstance(one.mark, Option) and not one.mark.hidden
    ]
    return _text(usage, _paragraphs(command), named, [*rows, _HELP_ROW])


def _option_row(one: Parameter) -> tuple[str, str]:
    from rosz.cli.declare import Option

    assert isinstance(one.mark, Option)  # noqa: S101  # whoever calls has looked
    spelled = ", ".join(sorted(one.mark.spelled(one.name), key=len))
    label = spelled if one.kind is bool else f"{spelled} {_metavar(one)}"
    default = f"[default: {_brief(one.default)}]" if one.default else ""
    return label, " ".join(filter(None, (one.mark.help, default)))


def _brief(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _metavar(one: Parameter) -> str:
    return (one.mark and one.mark.metavar) or one.name.upper()


def _paragraphs(command: Command) -> list[str]:
    """Return what a command is for; the first paragraph tells it in short."""
    text = command.help or command.function.__doc__ or ""
    return [" ".join(part.split()) for part in text.split("\n\n") if part.strip()]


def _text(
    usage: str,
    paragraphs: Iterable[str],
    *tables: Sequence[tuple[str, str]],
    tail: str = "",
) -> str:
    width = _width()
    parts = ["\n".join(_wrapped(usage, width, " " * len("usage: ")))]
    parts += ["\n".join(_wrapped(paragraph, width)) for paragraph in paragraphs]
    parts += ["\n".join(_table(rows, width)) for rows in tables if rows]
    parts += ["\n".join(_wrapped(tail, width))] if tail else []
    return "\n\n".join(parts) + "\n"


def _table(rows: Sequence[tuple[str, str]], width: int) -> Iterator[str]:
    """Yield the lines of labels with what they mean beside, or below where there is no room."""
    longest = min(_WIDEST_LABEL, width // 2)
    beside = max((len(label) for label, _ in rows if len(label) <= longest), default=0)
    indent = " " * (beside + 4)
    for label, text in rows:
        first, *others = _wrapped(text, width - len(indent))
        if len(label) > longest:
            yield from ("  " + line for line in _wrapped(label, width - 2))
            others.insert(0, first)
        else:
            yield f"  {label:<{beside}}  {first}".rstrip()
        yield from (indent + line for line in others)


def _wrapped(text: str, width: int, hanging: str = "") -> Iterator[str]:
    """Yield a text in lines; a word that is longer than a line is left whole."""
    line = ""
    for word in text.split():
        if line.strip() and len(line) + 1 + len(word) > width:
            yield line
            line = hanging + word
        else:
            line = f"{line} {word}" if line else word
    yield line


def _width() -> int:
    given = os.environ.get("COLUMNS", "")
    if given.isdecimal() and int(given):
        wide = int(given)
    else:
        try:
            wide = os.get_terminal_size(sys.stdout.fileno()).columns or _USUAL
        except (OSError, ValueError):  # it is no terminal, or no file at all
            wide = _USUAL
    return min(max(wide, _NARROWEST), _WIDEST)
