"""Checking .msg, .srv and .action files: all that is wrong, not only the first of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rosz.errors import DefinitionError, RoszError, TypeNotFound
from rosz.idl import Catalog, parse_action, read_definition
from rosz.workspace.problem import Problem, from_error

__all__ = ("KINDS", "check_definitions")

KINDS = ("msg", "srv", "action")


def check_definitions(folder: Path, package: str, catalog: Catalog) -> Iterator[Problem]:
    """Yield what is wrong in the definitions of a package.

    Args:
        folder: The package.
        package: Its name.
        catalog: All definitions that can be found.
    """
    for kind in KINDS:
        for file in sorted((folder / kind).glob(f"*.{kind}")):
            name = f"{package}/{kind}/{file.stem}"
            try:
                if kind == "msg":
                    catalog.message(name)
                elif kind == "srv":
                    catalog.service(name)
                else:
                    _check_action(name, file, catalog)
            except RoszError as fault:
                yield from_error(fault, file)


def _check_action(name: str, file: Path, catalog: Catalog) -> None:
    definition = read_definition(file)
    action = parse_action(name, definition.text, definition.path)
    for part in (action.goal, action.result, action.feedback):
        for field in part.fields:
            if field.type.primitive:
                continue
            try:
                catalog.message(field.type.base)
            except TypeNotFound as fault:
                reason = f"type '{field.type.written}' of field '{field.name}': {fault}"
                raise DefinitionError(reason, str(file), field.line, field.column) from fault
