"""Complete a command line: ``rosz complete SHELL LINE``, which the TAB key of a shell runs.

The output has one candidate per line. It is empty if nothing matches or an error occurs. Candidates
from the network that do not arrive within the time limit are left out. The options come from the
declarations of the commands.
"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from rosz.cli import suggest
from rosz.cli.commands import COMMANDS, OLD_NAMES, load
from rosz.cli.declare import Argument, CommandParameter, Option
from rosz.cli.env import ALIASES
from rosz.cli.suggest import Line, Source
from rosz.cli.system import pages
from rosz.environment import Environment
from rosz.errors import RoszError

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
    shell, text = (*argv, "", "")[:2]
    words = split_line(text)
    if words is None:
        return 0
    *before, word = words
    try:
        first, *rest = expand(before) or [""]
        line = Line(Environment.read(), Path.cwd(), first, rest, word)
        fitting = candidates(line)
    except (RoszError, OSError):  # an error message would disturb the person who types
        return 0
    fitting = sorted({entry for entry in fitting if entry.startswith(word)})
    if shell == "bash" and (cut := max(word.rfind(mark) for mark in _BASH_BREAKS) + 1):
        fitting = [candidate[cut:] for candidate in fitting]
    if shell != "fish":  # fish quotes candidates by itself
        fitting = [_quote(candidate) for candidate in fitting]
    sys.stdout.write("".join(f"{candidate}\n" for candidate in fitting))
    sys.stdout.flush()
    if not line.is_idle():
        os._exit(0)  # a thread may wait for the network for long
    return 0


def split_line(line: str) -> list[str] | None:
    """Return the words of the last command of a line, the last word possibly empty.

    There are none (``None``) when a shell would not accept the line so far.
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


def candidates(line: Line) -> list[str]:
    """Return the words that may stand at the cursor, whatever its word begins with.

    Args:
        line: The line, whose group and words before the cursor are those that `expand` returns.

    Raises:
        RoszError: Something that is named before the cursor does not exist.
    """
    first, rest, word = line.group, list(line.before), line.word
    if not first:
        return []
    if first != "rosz":
        return HELPERS[first](line) if len(rest) < _HELPER_WORDS.get(first, 2) else []
    if rest == ["help"]:
        return [*pages(), *COMMANDS]
    if rest[:2] in (["ros2", "run"], ["ros2", "launch"]) and not word.startswith("-"):
        rest = rest[1:]  # packages and programs, as for rosz
    if rest[:1] == ["ros2"]:
        from rosz.cli.ros2 import words_after

        return words_after(rest[1:])
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


def _source(
    parameters: Sequence[CommandParameter], words: Sequence[str], line: Line
) -> Source | None:
    """Return the source of the word at the cursor, and set the words before it."""
    pending, ended = _read_before(parameters, words, line)
    if pending is not None:
        return pending.mark.source
    if line.word.startswith("-") and not ended:
        shown = [
            max(parameter.spellings, key=len)
            for parameter in parameters
            if isinstance(parameter.mark, Option) and parameter.mark.help
        ]
        return lambda _: [*shown, "--help"]
    arguments = [parameter for parameter in parameters if isinstance(parameter.mark, Argument)]
    for place, argument in enumerate(arguments):
        if place == len(line.before) or argument.many:
            return argument.mark.source
    return None


def _read_before(
    parameters: Sequence[CommandParameter], words: Sequence[str], line: Line
) -> tuple[CommandParameter | None, bool]:
    """Set the positional words before the cursor.

    Return the option whose value stands at the cursor, and whether options have ended.
    """
    options = {spelling: parameter for parameter in parameters for spelling in parameter.spellings}
    left = iter(words)
    before: list[str] = []
    line.before = before
    for word in left:
        if word == "--":
            before += left
            return None, True
        option = options.get(word) if word.startswith("-") else None
        if option is not None and option.kind is not bool:
            if next(left, None) is None:
                return option, False
        elif not word.startswith("-"):
            before.append(word)
    return None, False


def _quote(word: str) -> str:
    """Return a word quoted for a shell, or unchanged where that means the same."""
    if word.endswith((":=", "/")) and shlex.quote(word[:-2]) == word[:-2]:
        return word
    bare = word.replace("~", "").replace("=", "").replace(":", "")
    return word if not bare or shlex.quote(bare) == bare else shlex.quote(word)
