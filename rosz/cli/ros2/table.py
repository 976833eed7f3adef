"""The commands of ``ros2``: where each is, what it does, and its options.

They stand in ``commands.txt``, where ``#`` begins a comment. A line that begins with ``:`` is a
command: its words, its module and function, its description. Below it stand its options and
arguments, each with its description behind ``|``: spellings, the name of a value with ``?``,
``*``, ``+`` or ``...`` for its number, ``:`` and its type, ``=`` and its default, ``~`` and what
stands for it when it is left out; choices in brackets, ``@`` and the group of options that
exclude each other, ``>`` and its name for the program. ``:$`` and a name begin a part, which
``$`` and the name stand for.
"""

from __future__ import annotations

import os
import re
from argparse import REMAINDER, ArgumentTypeError
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any, NamedTuple

GROUPS = {
    "action": "Various action related sub-commands",
    "bag": "Various rosbag related sub-commands",
    "daemon": "Various daemon related sub-commands",
    "interface": "Show information about ROS interfaces",
    "lifecycle": "Various lifecycle related sub-commands",
    "multicast": "Various multicast related sub-commands",
    "node": "Various node related sub-commands",
    "param": "Various param related sub-commands",
    "pkg": "Various package related sub-commands",
    "service": "Various service related sub-commands",
    "topic": "Various topic related sub-commands",
}
"""The groups of commands, with their descriptions."""

_FILE = __file__.replace("table.py", "commands.txt")
_HEAD = re.compile(r":([a-z_ ]+) (\w+:\w+) (.*)|:(\$\w+)")
_CHOICES = re.compile(r"\[(.*)\]")
_VALUE = re.compile(r"(\w*)([?*+]|\.\.\.)?(?::(\w+))?(?:=([^~]*))?(?:~(\S+))?")


class Verb(NamedTuple):
    """A command.

    Attributes:
        place: Module and function.
        text: Description for help.
        lines: The lines of its options and arguments.
    """

    place: str
    text: str
    lines: list[str]


class Flag(NamedTuple):
    """An option or an argument.

    Attributes:
        names: The spellings of an option, or the name of an argument.
        group: Name of the group of options that exclude each other.
        settings: Further arguments of argparse.
    """

    names: list[str]
    group: str
    settings: dict[str, Any]


@cache
def _table() -> dict[str, Verb]:
    """Return the commands by their words, and the parts by ``$`` and their names."""
    table: dict[str, Verb] = {}
    lines: list[str] = []
    with open(_FILE, encoding="utf-8") as file:  # noqa: PTH123  # importing pathlib takes long
        text = file.read()
    for line in text.splitlines():
        head = _HEAD.fullmatch(line)
        if head is not None:
            lines = []
            table[head[1] or head[4]] = Verb(head[2], head[3], lines)
        elif line and not line.startswith("#"):
            lines.append(line)
    return table


def verbs() -> dict[str, Verb]:
    """Return all commands by their words."""
    return {words: verb for words, verb in _table().items() if not words.startswith("$")}


def flags(lines: Iterable[str]) -> Iterator[Flag]:
    """Yield the options and arguments of the lines of a command."""
    for line in lines:
        if line.startswith("$"):
            yield from flags(_table()[line].lines)
        else:
            yield _read(line)


def _read(line: str) -> Flag:
    form, _, text = line.partition(" | ")
    choices = _CHOICES.search(form)
    words = _CHOICES.sub("", form).split()
    names = [word for word in words if word.startswith("-")]
    marks = {word[0]: word[1:] for word in words if word[0] in "@>"}
    value = next((word for word in words if word[0] not in "-@>"), "")
    # The pattern takes any text.
    name, number, kind, default, constant = _VALUE.fullmatch(value).groups()  # type: ignore[union-attr]
    several = number == "*" or (number == "+" and names)
    settings: dict[str, Any] = {
        "help": text,
        "action": None if value or choices else "store_true",
        "choices": choices[1].split() if choices else None,
        "dest": marks.get(">"),
        "metavar": name or None,
        "nargs": REMAINDER if number == "..." else number,
        "type": _TYPES.get(kind),
        "default": [] if several else default,
        "const": constant,
    }
    given = {key: each for key, each in settings.items() if each is not None}
    return Flag(names or [given.pop("dest", name)], marks.get("@", ""), given)


def _whole(text: str) -> int:
    if not text.isdecimal() or not int(text):
        raise ArgumentTypeError("value must be a positive integer")
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ArgumentTypeError("Expects a floating point number") from None
    if not value > 0:
        raise ArgumentTypeError("Value must be positive")
    return value


def _existing(text: str) -> str:
    if not os.path.exists(text):  # noqa: PTH110  # importing pathlib takes long
        raise ArgumentTypeError(f"Bag path '{text}' does not exist!")
    return text


def nonnegative_int(text: str) -> int:
    """Return a number of things; argparse shows the name of this function."""
    if int(text) < 0:
        raise ValueError(text)
    return int(text)


_TYPES: dict[str | None, Callable[[str], Any]] = {
    "int": int,
    "float": float,
    "count": nonnegative_int,
    "exists": _existing,
    "whole": _whole,
    "positive": _positive,
}
