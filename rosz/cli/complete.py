"""``rosz complete``: what the TAB key of a shell asks; see `rosz.introspect.completion`.

It prints a candidate on each line, and nothing at all where there is nothing to say, goes wrong or
would take long.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
from collections.abc import Sequence
from typing import Literal

from rosz.introspect.shells import COMMANDS

__all__ = ("complete",)

_OPERATORS = frozenset(";&|()")
_BREAKS = ":="
"""What bash takes for an end of a word, so that a candidate must begin behind it."""

Shell = Literal["bash", "zsh", "fish"]


def complete(argv: Sequence[str]) -> int:
    """Print the candidates for the last word of a command line.

    Args:
        argv: The shell, and the command line up to the cursor.
    """
    from rosz.environment import Environment
    from rosz.errors import RoszError

    shell, line = (*argv, "", "")[:2]
    try:
        patience = Environment.read().completion
    except RoszError:  # a person is typing: this is no moment to complain
        return 0
    watchdog = threading.Timer(patience, lambda: os._exit(0))
    watchdog.daemon = True
    watchdog.start()
    words = split_line(line)
    if words is None:
        return 0
    *before, word = words
    found = _candidates(expand(before), word)
    if shell == "bash" and (cut := max(word.rfind(mark) for mark in _BREAKS) + 1):
        found = [candidate[cut:] for candidate in found]
    if shell != "fish":  # which quotes by itself
        found = [_quoted(candidate) for candidate in found]
    sys.stdout.write("".join(f"{candidate}\n" for candidate in found))
    sys.stdout.flush()
    watchdog.cancel()
    return 0


def _candidates(words: list[str], word: str) -> list[str]:
    from rosz.cli.grammar import candidates
    from rosz.errors import RoszError

    if not words:
        return []
    try:
        found = candidates(words, word)
    except (RoszError, OSError):  # a person is typing: this is no moment to complain
        return []
    return sorted({one for one in found if one.startswith(word)})


def split_line(line: str) -> list[str] | None:
    """Return the words of the last command of a line, the one at its end possibly empty.

    Returns:
        None where the line is none that a shell would take so far.
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


def expand(words: list[str]) -> list[str]:
    """Return the words behind ``rosz`` that a command line stands for; none if it is not ours."""
    rest = list(words)
    while rest and "=" in rest[0] and not rest[0].startswith("="):
        rest.pop(0)  # a variable for this command
    if not rest:
        return []
    command = rest[0].rpartition("/")[2]
    if command == "rosz":
        return ["rosz", *rest[1:]]
    if command in COMMANDS:
        return ["rosz", *COMMANDS[command].split(), *rest[1:]]
    return rest if command in {"roscd", "rosls", "rosed", "rospack"} else []


def _quoted(word: str) -> str:
    """Return a word as a shell takes it, left alone where that is the same."""
    if word.endswith((":=", "/")) and shlex.quote(word[:-2]) == word[:-2]:
        return word
    bare = word.replace("~", "").replace("=", "").replace(":", "")
    return word if not bare or shlex.quote(bare) == bare else shlex.quote(word)
