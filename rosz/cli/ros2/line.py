"""Read a command line of ``ros2``, run it, and end with its exit code.

Only the parser of the command that is given gets options, since building them all takes long.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any

from rosz.cli.console import print_error
from rosz.cli.ros2.table import GROUPS, Verb, flags, verbs
from rosz.errors import RoszError

_INTERRUPTED = 2
"""The exit code of ROS 2's commands after Ctrl-C, the number of SIGINT."""
_Run = Callable[[Namespace], int | str | None]
"""A command: it returns its exit code, or the text of an error."""


def main(words: Sequence[str]) -> int:
    """Run a command line, and return its exit code."""
    try:
        run, given = _read(words)
        result = run(given)
    except SystemExit as end:  # argparse has printed help, or what is wrong
        return int(end.code or 0)
    except RoszError as error:
        result = str(error)
    except KeyboardInterrupt:
        return _INTERRUPTED
    if isinstance(result, str):
        sys.stdout.flush()
        print_error(result)
        return 1
    return result or 0


def _read(words: Sequence[str]) -> tuple[_Run, Namespace]:
    """Return the command of a line, and its arguments.

    Raises:
        SystemExit: The line is wrong, or asks for help.
    """
    table = verbs()
    top = ArgumentParser(
        "ros2",
        description="ros2 is an extensible command-line tool for ROS 2.",
        formatter_class=RawDescriptionHelpFormatter,
    )
    top.add_argument("--use-python-default-buffering", action="store_true", help="ignored")
    alone = {name: verb.text for name, verb in table.items() if " " not in name}
    name, parser = _choose(top, words, GROUPS | alone)
    verb = table.get(name)
    if parser is not None and verb is None:
        top, outer, rest = parser, top, words[words.index(name) + 1 :]
        parser.description = GROUPS[name]
        if name in {"topic", "service"}:
            hidden = f"--include-hidden-{name}s"
            parser.add_argument(hidden, action="store_true", help="list hidden ones as well")
        own = {
            key.split()[1]: each.text for key, each in table.items() if key.startswith(f"{name} ")
        }
        second, parser = _choose(top, rest, own)
        verb = table.get(f"{name} {second}")
        shown, top = top, outer
    else:
        shown = top
    if parser is None or verb is None:
        top.parse_args(words)
        return lambda _: shown.print_help(), Namespace()
    _add_options(parser, verb)
    given = top.parse_args(words)
    given.group = name
    module, _, function = verb.place.partition(":")
    run: _Run = getattr(import_module(f"rosz.cli.ros2.{module}"), function)
    return run, given


def _choose(
    parser: ArgumentParser, words: Sequence[str], described: Mapping[str, str]
) -> tuple[str, ArgumentParser | None]:
    """Add the commands of a parser; return the name and the parser of the one that is given."""
    name = next((word for word in words if not word.startswith("-")), "")
    width = max(map(len, described))
    rows = [f"{each:<{width}}  {text}\n" for each, text in sorted(described.items())]
    group = parser.add_subparsers(
        title="Commands",
        description="".join(rows) if name not in described else "",
        metavar=f"Call `{parser.prog} <command> -h` for more detailed usage.",
    )
    made = {each: group.add_parser(each, add_help=each == name) for each in sorted(described)}
    for each in made.values():
        each.formatter_class = RawDescriptionHelpFormatter
    return name, made.get(name)


def _add_options(parser: ArgumentParser, verb: Verb) -> None:
    parser.description = verb.text
    groups: dict[str, Any] = {"": parser}
    for flag in flags(verb.lines):
        if flag.group not in groups:
            groups[flag.group] = parser.add_mutually_exclusive_group()
        groups[flag.group].add_argument(*flag.names, **flag.settings)


def words_after(words: Sequence[str]) -> list[str]:
    """Return the commands and options that may follow some words, for completion."""
    table = verbs()
    command = [word for word in words if not word.startswith("-")]
    verb = table.get(" ".join(command[:2])) or table.get("".join(command[:1]))
    if verb is not None:
        names = [flag.names[-1] for flag in flags(verb.lines)]
        return [*(name for name in names if name.startswith("-")), "--help"]
    if command[:1] and command[0] in GROUPS:
        own = [key.split()[1] for key in table if key.startswith(f"{command[0]} ")]
        return [*own, "--help"]
    return [*GROUPS, *(key for key in table if " " not in key), "--help"]
