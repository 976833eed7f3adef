"""The command line of a ROS 2 program, ``--ros-args … --``, and what ROS 1 puts there.

See design.ros2.org, ROS Command Line Arguments.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from rosz import remap
from rosz.errors import NotFoundError, UsageError, YamlError
from rosz.params.yaml_nodes import read_plain
from rosz.remap import Arguments

__all__ = ("RosArguments", "parse", "remove_ros_args")

_BEGIN, _END = "--ros-args", "--"
_ALONE = frozenset({
    "--enable-rosout-logs", "--disable-rosout-logs", "--enable-stdout-logs",
    "--disable-stdout-logs", "--enable-external-lib-logs", "--disable-external-lib-logs",
})  # fmt: skip


class RosArguments(msgspec.Struct, frozen=True):
    """What a command line says.

    Attributes:
        arguments: In rosz's terms.
        params: Values of parameters by name, for all nodes under ``""`` and for single ones under
            their names.
        level: Least level that is logged; empty where it says none.
        rest: What belongs to the program.
    """

    arguments: Arguments
    params: dict[str, dict[str, Any]]
    level: str
    rest: tuple[str, ...]


def remove_ros_args(args: Sequence[str]) -> list[str]:
    """Return a command line without what is ROS's."""
    kept: list[str] = []
    ours = False
    for word in args:
        if ours:
            ours = word != _END
        elif word == _BEGIN:
            ours = True
        else:
            kept.append(word)
    return kept


def parse(args: Sequence[str]) -> RosArguments:
    """Sort a command line without its program name.

    Raises:
        UsageError: Something between ``--ros-args`` and ``--`` means nothing.
        NotFoundError: A file of parameters is not there.
        YamlError: A file of parameters is no YAML.
    """
    classic = remap.parse(remove_ros_args(args))
    remaps, special = dict(classic.remaps), dict(classic.special)
    params: dict[str, dict[str, Any]] = {"": {}}
    for name, text in classic.params.items():
        params[""][name] = _value(text, f"_{name}:={text}")
    level = ""
    for option, value in _options(args):
        if option in {"-r", "--remap"}:
            _remap(value, remaps, special)
        elif option in {"-p", "--param"}:
            node, name, text = _parted(value)
            params.setdefault(node, {})[name] = _value(text, value)
        elif option == "--params-file":
            for node, values in _read(value):
                params.setdefault(node, {}).update(values)
        elif option == "--log-level":
            level = value.rpartition(":=")[2]
        elif option not in {"-e", "--enclave", "--log-config-file", "--log-file-name"}:
            raise UsageError(f"'{option}' is no ROS argument; expected -r, -p or --params-file")
    rest = remap.Arguments(remaps, {}, special, classic.rest)
    return RosArguments(rest, params, level, classic.rest)


def _options(args: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the options between ``--ros-args`` and ``--`` with their values."""
    ours = False
    words = iter(args)
    for word in words:
        if not ours:
            ours = word == _BEGIN
        elif word == _END:
            ours = False
        elif word not in _ALONE:
            value = next(words, None)
            if value is None:
                raise UsageError(f"'{word}' is the last word; expected something behind it")
            yield word, value


def _parted(rule: str) -> tuple[str, str, str]:
    """Part ``node:name:=value``; the node may be missing."""
    left, separator, right = rule.partition(":=")
    node, colon, name = left.partition(":")
    if not separator or not (name if colon else node):
        raise UsageError(f"'{rule}' means nothing; expected name:=value")
    return (node, name, right) if colon else ("", node, right)


def _remap(rule: str, remaps: dict[str, str], special: dict[str, str]) -> None:
    _, name, target = _parted(rule)
    if name in {"__node", "__name"}:
        special["__name"] = target
    elif name == "__ns":
        special["__ns"] = target
    else:
        remaps[name] = target


def _value(text: str, rule: str) -> Any:
    try:
        return next(read_plain(text, "<value>"), None)
    except YamlError as error:
        raise UsageError(f"'{rule}' has no YAML value: {error.reason}") from error


def _read(path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the nodes of a parameter file with their values; ``/**`` means all."""
    try:
        text = Path(path).read_text("utf-8")
    except OSError as error:
        raise NotFoundError(f"parameter file '{path}': {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise YamlError("it is not UTF-8", path) from error
    tree = next(read_plain(text, path), None) or {}
    yield from _nodes(tree, "", path)


def _nodes(tree: Any, name: str, path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    if not isinstance(tree, dict):
        raise YamlError(f"'{name}' has no 'ros__parameters'", path)
    for key, inner in tree.items():
        if key == "ros__parameters":
            if not isinstance(inner, dict | None):
                raise YamlError(f"'ros__parameters' of '{name}' is no dictionary", path)
            yield ("" if name in {"/**", "**"} else name), dict(_flat(inner or {}, ""))
        else:
            yield from _nodes(inner, f"{name.rstrip('/')}/{key}" if name else str(key), path)


def _flat(tree: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
