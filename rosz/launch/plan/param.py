"""Read ``<param>`` and ``<rosparam>``: the sources, types and names of parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

from rosz import names
from rosz.errors import LaunchError, ParamError, YamlError, near_miss
from rosz.launch.plan.context import LaunchContext
from rosz.launch.plan.document import TagError, TextError
from rosz.launch.plan.model import PlanBuilder, SetupPlan
from rosz.launch.plan.scope import join
from rosz.launch.plan.substitution import guess_type, parse_bool
from rosz.launch.plan.tag import Tag

_SOURCES = ("value", "textfile", "binfile", "command")
_COMMANDS = ("load", "dump", "delete")


def _parse_number(convert: Callable[[str], float], noun: str, text: str) -> float:
    try:
        return convert(text)
    except ValueError:
        raise ValueError(f"'{text}' is not {noun}") from None


def _load_yaml(text: str, *, null_as_empty: bool = False) -> Any:
    """Return the value of a YAML text; a text without any value is the empty dict.

    Raises:
        YamlError: If the text is not YAML, has several documents, or a value that is not allowed.
    """
    from rosz.params.yaml import load_all

    documents = load_all(text, "<string>", null_as_empty=null_as_empty)
    if len(documents) > 1:
        raise YamlError(f"it has {len(documents)} documents, expected one", "<string>")
    return documents[0] if documents else {}


_TYPES: Mapping[str, Callable[[str], Any]] = {
    "auto": guess_type,
    "bool": parse_bool,
    "boolean": parse_bool,
    "double": partial(_parse_number, float, "a double"),
    "int": partial(_parse_number, int, "an int"),
    "str": str,
    "string": str,
    "yaml": _load_yaml,
}


def read_param(tag: Tag, builder: PlanBuilder, *, in_node: bool = False) -> None:
    """Read ``<param>``.

    A ``~name``, and any name inside a node, is added to the scope, for the nodes of the scope.

    Raises:
        TagError: If an attribute is missing or wrong, or the value cannot be read.
    """
    tag.check()
    given = [source for source in _SOURCES if source in tag.element.attributes]
    if len(given) != 1:
        sources = f"has {' and '.join(given)}" if given else "has none"
        tag.fail(f"<param> takes one of {', '.join(_SOURCES)}; this one {sources}")
    name = tag.require("name").strip()
    value = _read_value(tag, builder.context, given[0])
    if in_node or name.startswith("~"):
        tag.scope.add_private(names.canonical(name), value, tag.place)
        return
    with tag.refusing("name"):
        builder.add_param(join(tag.scope.ns, name), value, tag.place)


def _read_value(tag: Tag, context: LaunchContext, source: str) -> Any:
    type_name = (tag.element.attributes.get("type") or "auto").lower().strip()
    if type_name not in _TYPES and source != "binfile":
        hint = near_miss(type_name, _TYPES) or f"; there are {', '.join(_TYPES)}"
        tag.fail(f"'{type_name}' is not a type of <param>{hint}", "type")
    origin = tag.require(source)
    if source == "binfile":
        return _read_file(tag, context, origin, source)
    if source == "value":
        text = origin.strip()
    elif source == "textfile":
        text = _decode(tag, _read_file(tag, context, origin, source), source)
    else:
        text = _read_output(tag, context)
    try:
        return _TYPES[type_name](text)
    except ValueError as error:
        tag.fail(str(error), source)
    except YamlError as error:
        tag.fail(error.reason, source)


def _read_file(tag: Tag, context: LaunchContext, path: str, attribute: str) -> bytes:
    try:
        return context.read(path)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        tag.fail(f"'{path}' cannot be read: {reason}", attribute)


def _decode(tag: Tag, data: bytes, attribute: str, *, newlines: bool = True) -> str:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        tag.fail(f"the data of '{attribute}' is not UTF-8: {error.reason}", attribute)
    return text.replace("\r\n", "\n").replace("\r", "\n") if newlines else text


def _read_output(tag: Tag, context: LaunchContext) -> str:
    words = tag.words("command")
    if not words:
        tag.fail("'command' is empty", "command")
    try:
        data = context.run(words)
    except OSError as error:
        tag.fail(f"'{' '.join(words)}' cannot be started: {error.strerror}", "command")
    except LaunchError as error:
        tag.fail(str(error), "command")
    return _decode(tag, data, "command", newlines=False)


def read_rosparam(tag: Tag, builder: PlanBuilder) -> None:
    """Read ``<rosparam>``.

    Raises:
        TagError: If an attribute or the YAML is wrong, or a file cannot be read.
    """
    tag.check()
    command = tag.get("command") or "load"
    file = tag.get("file")
    param = join(tag.get("ns") or "", tag.get("param") or "")
    substitute = tag.flag("subst_value")
    name = join(tag.scope.ns, param) if param else tag.scope.ns
    if command not in _COMMANDS:
        hint = near_miss(command, _COMMANDS) or f"; there are {', '.join(_COMMANDS)}"
        tag.fail(f"<rosparam> has no command '{command}'{hint}", "command")
    if command == "load":
        _load(tag, builder, name, file, substitute=substitute, named=bool(param))
        return
    if name.startswith("~"):
        name = f"/rosparam/{name[1:]}"
    if command == "delete":
        if file is not None:
            tag.fail("command='delete' takes no file", "file")
        step = SetupPlan("delete", names.canonical(name), "", tag.place)
    else:
        if not file:
            tag.fail("command='dump' needs a file", "command" if file is None else "file")
        step = SetupPlan("dump", names.canonical(name), file, tag.place)
    builder.setup.append(step)


def _load(
    tag: Tag, builder: PlanBuilder, name: str, file: str | None, *, substitute: bool, named: bool
) -> None:
    from rosz.params.ros2_file import assign

    text = tag.element.text
    if file is not None:
        if not file:
            tag.fail("'file' is empty", "file")
        text = _decode(tag, _read_file(tag, builder.context, file, "file"), "file")
    with _located(tag, file, text):
        value = _load_yaml(tag.substitute(text) if substitute else text, null_as_empty=True)
        parameters = assign(value, name)
    if not named and not isinstance(value, dict):
        tag.fail(
            f"<rosparam> without 'param' needs a dict, got {type(value).__name__}: {value!r:.60}"
        )
    with _located(tag, file):
        for space, inner in parameters:
            builder.add_params(space, inner, tag.place)


@contextmanager
def _located(tag: Tag, file: str | None, text: str = "") -> Iterator[None]:
    """Refuse the launch file for an error in a block, with its place in the YAML."""
    try:
        yield
    except TextError as error:
        *before, last = text[: error.index].split("\n")
        raise _locate(tag, file, error.reason, len(before), len(last)) from error
    except YamlError as error:
        line, column = max(error.line - 1, 0), max(error.column - 1, 0)
        raise _locate(tag, file, error.reason, line, column) from error
    except ParamError as error:
        raise _locate(tag, file, str(error), 0, 0) from error


def _locate(tag: Tag, file: str | None, reason: str, line: int, column: int) -> TagError:
    """Return the error at a 0-based line and column of the YAML."""
    if file is not None:
        return TagError(tag.element, reason, place=(file, line + 1, column + 1))
    place = (tag.element.file, *tag.element.locate_text(line, column))
    return TagError(tag.element, reason, place=place)
