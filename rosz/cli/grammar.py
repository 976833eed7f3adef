"""The words that each command takes, for who completes them: read off the commands themselves."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec

from rosz.cli.declare import App, Option
from rosz.cli.main import COMMANDS
from rosz.cli.reading import parameters
from rosz.environment import Environment
from rosz.introspect.suggest import Suggestions

__all__ = ("candidates",)

_Source = Callable[[Suggestions, list[str], str], list[str]]
"""Gives candidates from the positional words before, and the word begun."""


def _topics(known: Suggestions, _: list[str], word: str) -> list[str]:
    return [*known.topics(), *(known.fields(word) if "/" in word[1:] else ())]


def _type_of_topic(known: Suggestions, before: list[str], _: str) -> list[str]:
    return known.type_of_topic(before[0])


def _launch(known: Suggestions, before: list[str], word: str) -> list[str]:
    """Return what may follow: a package or a file, then a file of the package, then args."""
    if not before:
        return [*known.packages(), *_launch_paths(known, word)]
    if len(before) == 1 and not before[0].endswith((".launch", ".xml")):
        return known.launch_files(before[0])
    args = known.launch_args(before)
    name, given, _ = word.partition(":=")
    if given:
        return [f"{name}:={args[name]}"] if args.get(name) else []
    done = {one.partition(":=")[0] for one in before}
    return [f"{arg}:=" for arg in args if arg not in done]


def _launch_paths(known: Suggestions, word: str) -> list[str]:
    return [path for path in known.files(word) if path.endswith(("/", ".launch", ".xml"))]


def _run(known: Suggestions, before: list[str], _: str) -> list[str]:
    return known.executables(before[0])


def _packages_or_files(known: Suggestions, _: list[str], word: str) -> list[str]:
    return [*known.packages(), *(path for path in known.files(word) if path.endswith("/"))]


def _plain(name: str) -> _Source:
    """Return a source that needs no other words."""
    return lambda known, _before, _word: list(getattr(known, name)())


def _typed(name: str, place: int) -> _Source:
    """Return a source that goes by one of the words before."""
    return lambda known, before, _word: list(getattr(known, name)(before[place]))


def _files(known: Suggestions, _: list[str], word: str) -> list[str]:
    return known.files(word)


def _nothing(_known: Suggestions, _before: list[str], _word: str) -> list[str]:
    return []


_NODES, _SERVICES, _PARAMS = _plain("nodes"), _plain("services"), _plain("params")
_PACKAGES, _MESSAGES = _plain("packages"), _plain("messages")
_SRV = _plain("service_definitions")

# What the positional words of a command are; the last source holds for all further words.
_WORDS: dict[tuple[str, ...], tuple[_Source, ...]] = {
    ("topic", "list"): (_topics, _nothing),
    ("topic", "info"): (_topics, _nothing),
    ("topic", "type"): (_topics, _nothing),
    ("topic", "echo"): (_topics, _nothing),
    ("topic", "hz"): (_topics,),
    ("topic", "bw"): (_topics, _nothing),
    ("topic", "delay"): (_topics, _nothing),
    ("topic", "find"): (_plain("topic_types"), _nothing),
    ("topic", "pub"): (_topics, _type_of_topic, _typed("message", 1), _nothing),
    ("service", "list"): (_SERVICES, _nothing),
    ("service", "info"): (_SERVICES, _nothing),
    ("service", "type"): (_SERVICES, _nothing),
    ("service", "args"): (_SERVICES, _nothing),
    ("service", "node"): (_SERVICES, _nothing),
    ("service", "uri"): (_SERVICES, _nothing),
    ("service", "find"): (_plain("service_types"), _nothing),
    ("service", "call"): (_SERVICES, _typed("request", 0), _nothing),
    ("node", "list"): (_NODES, _nothing),
    ("node", "info"): (_NODES,),
    ("node", "ping"): (_NODES, _nothing),
    ("node", "kill"): (_NODES,),
    ("node", "machine"): (_plain("machines"), _nothing),
    ("param", "list"): (_PARAMS, _nothing),
    ("param", "get"): (_PARAMS, _nothing),
    ("param", "set"): (_PARAMS, _nothing),
    ("param", "delete"): (_PARAMS, _nothing),
    ("param", "search"): (_PARAMS, _nothing),
    ("param", "watch"): (_PARAMS, _nothing),
    ("param", "dump"): (_files, _PARAMS, _nothing),
    ("param", "load"): (_files, _PARAMS, _nothing),
    ("msg", "show"): (_MESSAGES, _nothing),
    ("msg", "info"): (_MESSAGES, _nothing),
    ("msg", "md5"): (_MESSAGES, _nothing),
    ("msg", "hash"): (_MESSAGES, _nothing),
    ("msg", "package"): (_PACKAGES, _nothing),
    ("srv", "show"): (_SRV, _nothing),
    ("srv", "info"): (_SRV, _nothing),
    ("srv", "md5"): (_SRV, _nothing),
    ("srv", "hash"): (_SRV, _nothing),
    ("srv", "package"): (_PACKAGES, _nothing),
    ("pkg", "find"): (_PACKAGES, _nothing),
    ("pkg", "check"): (_packages_or_files,),
    ("pkg", "create"): (_nothing, _PACKAGES),
    ("gen",): (_PACKAGES,),
    ("log",): (_NODES,),
    ("run",): (_PACKAGES, _run, _files),
    ("launch",): (_launch,),
    ("reconfigure", "get"): (_NODES, _nothing),
    ("reconfigure", "describe"): (_NODES, _nothing),
    ("reconfigure", "watch"): (_NODES, _nothing),
    ("reconfigure", "set_from_parameters"): (_NODES, _nothing),
    ("reconfigure", "set"): (_NODES, _nothing),
    ("reconfigure", "dump"): (_NODES, _files, _nothing),
    ("reconfigure", "load"): (_NODES, _files, _nothing),
    ("env",): (lambda _known, _before, _word: ["bash", "zsh", "fish"], _nothing),
}

# What the values of options are, where that can be known.
_VALUES: dict[str, _Source] = {
    "--file": _files,
    "--store": _files,
    "--output": _files,
    "--pid": _files,
    "--textfile": _files,
    "--binfile": _files,
    "--restart": _NODES,
    "--stop": _NODES,
    "--level": lambda _known, _before, _word: ["debug", "info", "warn", "error", "fatal"],
}

_HELPERS: dict[str, tuple[_Source, ...]] = {
    "roscd": (lambda known, _before, word: known.inside(word), _nothing),
    "rosls": (lambda known, _before, word: known.inside(word), _nothing),
    "rosed": (_PACKAGES, _typed("files_of", 0), _nothing),
    "rospack": (lambda _known, _before, _word: ["find", "list", "list-names"], _PACKAGES, _nothing),
}


class _Option(msgspec.Struct, frozen=True):
    """An option: all its spellings, the longest last, and whether a value follows."""

    names: tuple[str, ...]
    takes_value: bool


def candidates(words: list[str], word: str) -> list[str]:
    """Return what may stand where a word has been begun; not only what begins as it does.

    Args:
        words: The command line before it: ``rosz`` and all that follows, or a helper of the shell.
        word: The word begun; may be empty.

    Raises:
        RoszError: What the words before name is not there.
    """
    known = Suggestions(Environment.read(), Path.cwd())
    first, *rest = words
    if first != "rosz":
        return _nth(_HELPERS[first], rest, known, word)
    if rest[:1] == ["help"]:
        rest = rest[1:]
    if not rest:
        return [*COMMANDS, "--help", "--version"] if word.startswith("-") else list(COMMANDS)
    name, *rest = rest
    if name not in COMMANDS:
        return []
    app = import_module(f"rosz.cli.{name}").app
    path: tuple[str, ...] = (name,)
    commands = _commands(app)
    if len(commands) > 1:
        if not rest:
            return list(commands)
        path, rest = (name, rest[0]), rest[1:]
    callback = commands.get(path[-1]) if len(path) > 1 else next(iter(commands.values()))
    options = [] if callback is None else _options(callback)
    return _in_command(path, options, rest, partial(_answer, known=known, word=word), word)


def _in_command(
    path: tuple[str, ...],
    options: list[_Option],
    rest: list[str],
    answer: Callable[[_Source, list[str]], list[str]],
    word: str,
) -> list[str]:
    """Return candidates within one command, from its options and positional words."""
    before, pending = _positional(rest, options)
    if pending is not None:
        source = next((_VALUES[name] for name in pending.names if name in _VALUES), _nothing)
        return answer(source, before)
    if word.startswith("-") and "--" not in rest:
        return [option.names[-1] for option in options] + ["--help"]
    sources = _WORDS.get(path, (_nothing,))
    return answer(sources[min(len(before), len(sources) - 1)], before)


def _answer(source: _Source, before: list[str], *, known: Suggestions, word: str) -> list[str]:
    return source(known, before, word)


def _nth(
    sources: tuple[_Source, ...], before: list[str], known: Suggestions, word: str
) -> list[str]:
    return sources[min(len(before), len(sources) - 1)](known, before, word)


def _positional(rest: list[str], options: list[_Option]) -> tuple[list[str], _Option | None]:
    """Return the words that are no options, and the option whose value is being typed."""
    takers = {name: option for option in options if option.takes_value for name in option.names}
    before: list[str] = []
    pending: _Option | None = None
    plain = False
    for word in rest:
        if pending is not None:
            pending = None
        elif word == "--":
            plain = True
        elif word.startswith("-") and not plain:
            pending = takers.get(word)
        else:
            before.append(word)
    return before, pending


def _commands(app: App) -> dict[str, Callable[..., Any]]:
    """Return the functions of an app by the names that a person types."""
    return {name: command.function for name, command in app.commands.items()}


def _options(callback: Callable[..., Any]) -> list[_Option]:
    """Return the options of a command by its function, those aside that are not shown."""
    return [
        _Option(tuple(sorted(one.mark.spelled(one.name), key=len)), one.kind is not bool)
        for one in parameters(callback)
        if isinstance(one.mark, Option) and not one.mark.hidden
    ]
