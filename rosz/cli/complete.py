"""Complete a command line: ``rosz complete SHELL LINE``, which the TAB key of a shell runs.

It prints one candidate per line, and nothing when there is no candidate, something fails or the
time limit has passed. The candidates come from the declarations of the commands.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rosz.cli import suggest
from rosz.cli.commands import COMMANDS, OLD_NAMES, load
from rosz.cli.declare import Argument, Option, Parameter
from rosz.cli.env import ALIASES
from rosz.cli.manual import pages
from rosz.cli.suggest import Line, Source
from rosz.environment import Environment
from rosz.errors import RoszError

__all__ = ("HELPERS", "candidates", "complete", "expand", "split_line")

HELPERS: dict[str, Source] = {
    "roscd": suggest.package_paths,
    "rosls": suggest.package_paths,
    "rosed": suggest.package_file_names,
    "rospack": suggest.rospack_commands,
}
"""ROS 1's commands that are not commands of rosz; each takes two words at most."""
_HELPER_WORDS = {"roscd": 1, "rosls": 1}
_OPERATORS = frozenset(";&|()")
_BASH_BREAKS = ":="
"""Bash takes these for the end of a word, so a candidate must begin behind the last of them."""


def complete(argv: Sequence[str]) -> int:
    """Print the candidates for the last word of a command line."""
    shell, line = (*argv, "", "")[:2]
    words = split_line(line)
    if words is None:
        return 0
    *before, word = words
    try:
        environment = Environment.read()
        with _time_limit(environment.completion):
            found = candidates(environment, expand(before), word)
    except (RoszError, OSError):  # an error message would disturb the person who types
        return 0
    found = sorted({one for one in found if one.startswith(word)})
    if shell == "bash" and (cut := max(word.rfind(mark) for mark in _BASH_BREAKS) + 1):
        found = [candidate[cut:] for candidate in found]
    if shell != "fish":  # fish quotes candidates by itself
        found = [_quote(candidate) for candidate in found]
    sys.stdout.write("".join(f"{candidate}\n" for candidate in found))
    sys.stdout.flush()
    return 0


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """End the process if a block takes longer than a time limit."""
    timer = threading.Timer(seconds, lambda: os._exit(0))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def split_line(line: str) -> list[str] | None:
    """Return the words of the last command of a line, the last word possibly empty.

    Returns:
        The words; ``None`` when a shell would not accept the line so far.
    """
    for close in ("", "'", '"'):
        lexer = shlex.shlex(line + close, posix=True, punctuation_chars="".join(_OPERATORS))
        lexer.whitespace_split = True
        lexer.commenters = ""
        try:
            words = list(lexer)
        except ValueError:
            continue
        if not close and (not line or line[-1].isspace()):
            words.append("")
        ends = [place for place, word in enumerate(words) if word and set(word) <= _OPERATORS]
        command = words[ends[-1] + 1 :] if ends else words
        return command or None
    return None


def expand(words: Sequence[str]) -> list[str]:
    """Return the ``rosz`` command line that a line means; empty if it is another program."""
    rest = list(words)
    while rest and "=" in rest[0] and not rest[0].startswith("="):
        rest.pop(0)  # an environment variable of this command
    if not rest:
        return []
    command = rest[0].rpartition("/")[2]
    if command == "rosz":
        return ["rosz", *rest[1:]]
    if command in ALIASES:
        first, *others = ALIASES[command].split()
        return ["rosz", OLD_NAMES.get(first, first), *others, *rest[1:]]
    return rest if command in HELPERS else []


def candidates(environment: Environment, words: Sequence[str], word: str) -> list[str]:
    """Return the words that may stand at the cursor, whatever its word begins with.

    The words before the cursor are those that `expand` returns.

    Raises:
        RoszError: Something that is named before the cursor does not exist.
    """
    from pathlib import Path

    if not words:
        return []
    first, *rest = words
    line = Line(environment, Path.cwd(), first, rest, word)
    if first != "rosz":
        return HELPERS[first](line) if len(rest) < _HELPER_WORDS.get(first, 2) else []
    if rest == ["help"]:
        return [*pages(), *COMMANDS]
    if rest[:1] == ["help"]:
        rest = rest[1:]
    if not rest:
        return [*COMMANDS, "--help", "--version"] if word.startswith("-") else list(COMMANDS)
    return _in_command(line, *rest)


def _in_command(line: Line, group: str, *words: str) -> list[str]:
    """Return the words that may stand at the cursor behind the name of a command or a group."""
    if group not in COMMANDS:
        return []
    line.group = group
    app = load(group)
    name, rest = "", list(words)
    if app.help:
        if not rest:
            return list(app.commands)
        name, *rest = rest
    command = app.commands.get(name)
    source = _source(command.parameters(), rest, line) if command else None
    return source(line) if source else []


def _source(parameters: Sequence[Parameter], words: Sequence[str], line: Line) -> Source | None:
    """Return the source of what may follow the words of a command, and set the words before."""
    options = {spelling: one for one in parameters for spelling in one.spellings}
    before: list[str] = []
    pending: Parameter | None = None
    ended = False
    for word in words:
        if pending is not None:
            pending = None
        elif word == "--":
            ended = True
        elif word.startswith("-") and not ended:
            one = options.get(word)
            pending = None if one is None or one.kind is bool else one
        else:
            before.append(word)
    line.before = before
    if pending is not None:
        return pending.mark and pending.mark.source
    if line.word.startswith("-") and not ended:
        shown = [one for one in parameters if isinstance(one.mark, Option) and one.mark.help]
        names = [max(one.spellings, key=len) for one in shown]
        return lambda _: [*names, "--help"]
    arguments = [one for one in parameters if isinstance(one.mark, Argument)]
    for place, one in enumerate(arguments):
        if place == len(before) or one.many:
            return one.mark and one.mark.source
    return None


def _quote(word: str) -> str:
    """Return a word quoted for a shell, or unchanged where that means the same."""
    if word.endswith((":=", "/")) and shlex.quote(word[:-2]) == word[:-2]:
        return word
    bare = word.replace("~", "").replace("=", "").replace(":", "")
    return word if not bare or shlex.quote(bare) == bare else shlex.quote(word)
