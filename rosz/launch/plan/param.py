"""``<param>`` and ``<rosparam>``: where values come from and where they go."""

from __future__ import annotations

from typing import Any, Literal

from rosz import names
from rosz.errors import LaunchError, YamlError, near_miss
from rosz.launch.plan.context import LaunchContext
from rosz.launch.plan.fault import Fault, TextFault
from rosz.launch.plan.ledger import Ledger
from rosz.launch.plan.model import SetupPlan
from rosz.launch.plan.scope import join
from rosz.launch.plan.tag import Tag
from rosz.launch.plan.value import TYPES, convert, load_yaml

__all__ = ("read_param", "read_rosparam")

_SOURCES = ("value", "textfile", "binfile", "command")
_COMMANDS = ("load", "dump", "delete")


def read_param(tag: Tag, ledger: Ledger, *, in_node: bool = False) -> None:
    """Read ``<param>``.

    A ``~name``, and any name inside a node, goes to the scope, for the nodes of the scope to take.

    Raises:
        Fault: An attribute is missing or wrong, or the value cannot be had.
    """
    tag.check()
    given = [source for source in _SOURCES if source in tag.element.attributes]
    if len(given) != 1:
        found = f"has {' and '.join(given)}" if given else "has none"
        tag.fail(f"<param> takes one of {', '.join(_SOURCES)}; this one {found}")
    name = tag.require("name").strip()
    value = _value(tag, ledger.context, given[0])
    if in_node or name.startswith("~"):
        tag.scope.add_private(names.canonical(name), value, tag.place)
        return
    try:
        ledger.add_param(join(tag.scope.ns, name), value, tag.place)
    except TextFault as fault:
        tag.fail(fault.reason, "name")


def _value(tag: Tag, context: LaunchContext, source: str) -> Any:
    type_name = (tag.element.attributes.get("type") or "auto").lower().strip()
    if type_name not in TYPES and source != "binfile":
        hint = near_miss(type_name, TYPES) or f"; there are {', '.join(TYPES)}"
        tag.fail(f"'{type_name}' is no type of <param>{hint}", "type")
    origin = tag.require(source)
    if source == "binfile":
        return _read(tag, context, origin, source)
    if source == "value":
        text = origin.strip()
    elif source == "textfile":
        text = _text(tag, _read(tag, context, origin, source), source)
    else:
        text = _output(tag, context)
    try:
        return convert(text, type_name)
    except ValueError as error:
        tag.fail(str(error), source)
    except YamlError as error:
        tag.fail(error.reason, source)


def _read(tag: Tag, context: LaunchContext, path: str, attribute: str) -> bytes:
    try:
        return context.read(path)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        tag.fail(f"'{path}' cannot be read: {reason}", attribute)


def _text(tag: Tag, data: bytes, attribute: str, *, newlines: bool = True) -> str:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        tag.fail(f"what '{attribute}' gives is not UTF-8: {error.reason}", attribute)
    return text.replace("\r\n", "\n").replace("\r", "\n") if newlines else text


def _output(tag: Tag, context: LaunchContext) -> str:
    words = tag.words("command")
    if not words:
        tag.fail("'command' is empty", "command")
    try:
        data = context.run(words)
    except OSError as error:
        tag.fail(f"'{' '.join(words)}' cannot be started: {error.strerror}", "command")
    except LaunchError as error:
        tag.fail(str(error), "command")
    return _text(tag, data, "command", newlines=False)


def read_rosparam(tag: Tag, ledger: Ledger) -> None:
    """Read ``<rosparam>``.

    Raises:
        Fault: An attribute or the YAML is wrong, or a file cannot be read.
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
        _load(tag, ledger, name, file, substitute=substitute, named=bool(param))
        return
    if command == "delete" and file is not None:
        tag.fail("command='delete' takes no file", "file")
    if command == "dump" and not file:
        tag.fail("command='dump' needs a file", "file" if file is not None else "command")
    if name.startswith("~"):
        name = f"/rosparam/{name[1:]}"
    action: Literal["dump", "delete"] = "dump" if command == "dump" else "delete"
    ledger.setup.append(SetupPlan(action, names.canonical(name), file or "", tag.place))


def _load(
    tag: Tag, ledger: Ledger, name: str, file: str | None, *, substitute: bool, named: bool
) -> None:
    text = tag.element.text
    if file is not None:
        if not file:
            tag.fail("'file' is empty", "file")
        text = _text(tag, _read(tag, ledger.context, file, "file"), "file")
    try:
        text = tag.substitute(text) if substitute else text
    except TextFault as fault:
        before = text[: fault.index]
        line, column = before.count("\n"), fault.index - before.rfind("\n") - 1
        raise _fault(tag, file, fault.reason, line, column) from fault
    try:
        value = load_yaml(text)
    except YamlError as error:
        line, column = max(error.line - 1, 0), max(error.column - 1, 0)
        raise _fault(tag, file, error.reason, line, column) from error
    if not named and not isinstance(value, dict):
        tag.fail(
            f"<rosparam> without 'param' needs a dict, got {type(value).__name__}: {value!r:.60}"
        )
    try:
        ledger.add_params(name, value, tag.place)
    except TextFault as fault:
        raise _fault(tag, file, fault.reason, 0, 0) from fault


def _fault(tag: Tag, file: str | None, reason: str, line: int, column: int) -> Fault:
    if file is not None:
        return Fault(tag.element, reason, place=(file, line + 1, column + 1))
    return Fault(
        tag.element, reason, place=(tag.element.file, *tag.element.locate_text(line, column))
    )
