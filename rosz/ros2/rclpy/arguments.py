"""The command line of a ROS 2 program: ``--ros-args … --``, and ROS 1's arguments.

See "ROS Command Line Arguments" on design.ros2.org.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from rosz import remap
from rosz.errors import NotFoundError, ParamError, UsageError, YamlError
from rosz.params.ros2_file import sections
from rosz.params.yaml import read_plain
from rosz.remap import Arguments

_BEGIN, _END = "--ros-args", "--"
_FLAGS = frozenset({
    "--enable-rosout-logs", "--disable-rosout-logs", "--enable-stdout-logs",
    "--disable-stdout-logs", "--enable-external-lib-logs", "--disable-external-lib-logs",
})  # fmt: skip


class RosArguments(msgspec.Struct, frozen=True):
    """The ROS arguments of a command line.

    Attributes:
        arguments: Remappings and special names, as rosz's own nodes use them.
        params: Values of parameters by name: under ``""`` those of all nodes, and under the name of
            a node its own.
        level: Lowest level that is logged; empty if there is none.
        rest: Arguments of the program itself.
    """

    arguments: Arguments
    params: dict[str, dict[str, Any]]
    level: str
    rest: tuple[str, ...]


def remove_ros_args(args: Sequence[str]) -> list[str]:
    """Return a command line without its ROS arguments."""
    kept: list[str] = []
    inside = False
    for word in args:
        if inside:
            inside = word != _END
        elif word == _BEGIN:
            inside = True
        else:
            kept.append(word)
    return kept


def parse(args: Sequence[str]) -> RosArguments:
    """Parse a command line without the program name.

    Raises:
        UsageError: An argument between ``--ros-args`` and ``--`` is not valid.
        NotFoundError: A parameter file does not exist.
        YamlError: A parameter file is not valid YAML.
    """
    classic = remap.parse(remove_ros_args(args))
    remaps, special = dict(classic.remaps), dict(classic.special)
    params: dict[str, dict[str, Any]] = {"": {}}
    for name, text in classic.params.items():
        params[""][name] = _value(text, f"_{name}:={text}")
    level = ""
    for option, value in _options(args):
        if option in {"-r", "--remap"}:
            _, name, target = _split(value)
            if name.startswith("__"):
                special["__name" if name == "__node" else name] = target
            else:
                remaps[name] = target
        elif option in {"-p", "--param"}:
            node, name, text = _split(value)
            params.setdefault(node, {})[name] = _value(text, value)
        elif option == "--params-file":
            for node, values in _read(value):
                params.setdefault(node, {}).update(values)
        elif option == "--log-level":
            level = value.rpartition(":=")[2]
        elif option not in {"-e", "--enclave", "--log-config-file", "--log-file-name"}:
            raise UsageError(f"'{option}' is not a ROS argument; expected -r, -p or --params-file")
    rest = remap.Arguments(remaps, {}, special, classic.rest)
    return RosArguments(rest, params, level, classic.rest)


def _options(args: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the options between ``--ros-args`` and ``--`` with their values."""
    inside = False
    words = iter(args)
    for word in words:
        if not inside:
            inside = word == _BEGIN
        elif word == _END:
            inside = False
        elif word != _BEGIN and word not in _FLAGS:
            value = next(words, None)
            if value is None:
                raise UsageError(f"'{word}' is the last argument; expected a value after it")
            yield word, value


def _split(rule: str) -> tuple[str, str, str]:
    """Split ``node:name:=value``; the node may be missing."""
    left, separator, right = rule.partition(":=")
    node, colon, name = left.partition(":")
    if not separator or not (name if colon else node):
        raise UsageError(f"'{rule}' is not a rule; expected name:=value")
    return (node, name, right) if colon else ("", node, right)


def _value(text: str, rule: str) -> Any:
    try:
        return next(read_plain(text, "<value>"), None)
    except YamlError as error:
        raise UsageError(f"the value of '{rule}' is not YAML: {error.reason}") from error


def _read(path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the nodes of a parameter file with their values; ``/**`` means all nodes."""
    try:
        text = Path(path).read_text("utf-8")
    except OSError as error:
        raise NotFoundError(f"parameter file '{path}': {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise YamlError("the file is not UTF-8", path) from error
    tree = next(read_plain(text, path), None) or {}
    try:
        for name, values in sections(tree):
            yield ("" if name in {"/**", "**"} else name), values
    except ParamError as error:
        raise YamlError(str(error), path) from error
