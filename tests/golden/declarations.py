"""The commands as they are declared, in words that do not depend on what reads them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from rosz.cli.commands import COMMANDS, load
from rosz.cli.declare import Command, CommandParameter, Option

__all__ = ("as_json", "lines")


def lines() -> list[str]:
    """Return the words of each command and each group, without ``rosz``."""
    found = [""]
    for name in COMMANDS:
        found.append(name)
        found += [f"{name} {command}" for command in load(name).commands if command]
    return found


def as_json() -> str:
    """Return the declarations as JSON, with one argument or option per line."""
    parts = []
    for line, declared in _declarations().items():
        values = [
            f"  {json.dumps(key)}: {_listed(value)}" for key, value in declared.items() if value
        ]
        parts.append(f" {json.dumps(line)}: {{\n" + ",\n".join(values) + "\n }")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _listed(value: Any) -> str:
    if not isinstance(value, list):
        return json.dumps(value)
    return "[\n" + ",\n".join(f"   {json.dumps(one)}" for one in value) + "\n  ]"


def _declarations() -> dict[str, dict[str, Any]]:
    """Return what each command and each group takes, and what it is for, by its words."""
    return {line: dict(_declaration(line)) for line in lines() if line}


def _declaration(line: str) -> Iterator[tuple[str, Any]]:
    group, _, name = line.partition(" ")
    app = load(group)
    if name not in app.commands:
        yield "help", app.help
        return
    command = app.commands[name]
    yield "help", _text(command)
    taken = [one for one in command.parameters() if one.mark is not None]
    yield "arguments", [_argument(one) for one in taken if not isinstance(one.mark, Option)]
    yield "options", [_option(one) for one in taken if isinstance(one.mark, Option)]


def _text(command: Command) -> str:
    return "\n\n".join(" ".join(part.split()) for part in command.help.split("\n\n"))


def _argument(one: CommandParameter) -> dict[str, Any]:
    assert one.mark is not None
    return {
        "metavar": one.mark.metavar or one.name.upper(),
        "type": getattr(one.kind, "__name__", "?"),
        "many": one.many,
        "required": one.required,
        "default": one.default,
        "help": one.mark.help or "",
    }


def _option(one: CommandParameter) -> dict[str, Any]:
    assert isinstance(one.mark, Option)
    shared = _argument(one)
    if one.kind is bool:
        del shared["metavar"]
    return {"names": sorted(one.spellings, key=len), **shared} | (
        {"hidden": True} if one.mark.help is None else {}
    )
