"""Command-line values of plain types, without what typer loads to check richer ones.

Since 0.27, typer checks every value with pydantic, whose import takes longer than most commands do.
Texts, numbers and lists of them, all that the commands here take, need none of it. A typer that
works otherwise is left as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from types import UnionType
from typing import Any, Union, get_args, get_origin

import typer
from typer.core import TyperCommand, TyperGroup

__all__ = ("LightCommand", "LightGroup", "make_light")

_SLOT = "_runtime_param"
_WORDS = {str: "text", int: "whole number", float: "number", bool: "truth value"}


class LightCommand(TyperCommand):
    """A command whose values are of plain types."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the arguments apart."""
        _lighten(self, ctx)
        return super().parse_args(ctx, args)


class LightGroup(TyperGroup):
    """A group of commands whose values are of plain types."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the arguments of the group apart."""
        _lighten(self, ctx)
        return super().parse_args(ctx, args)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command of the group; ``None`` if it has none of that name."""
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            _lighten(command, ctx)
        return command


def make_light(app: typer.Typer) -> None:
    """Have an app that leaves its classes to typer use the light ones."""
    for command in app.registered_commands:
        if command.cls in {None, TyperCommand}:
            command.cls = LightCommand
    if not isinstance(app.info.cls, type):
        app.info.cls = LightGroup


def _lighten(command: Any, ctx: Any) -> None:
    """Have the parameters of a command that are of plain types read without pydantic.

    Args:
        command: What typer made of a function.
        ctx: Its context, or that of the group that it is in.
    """
    for param in command.get_params(ctx):
        descriptor = getattr(param, "type_descriptor", None)
        kind = _plain_type(getattr(descriptor, "annotation", None))
        if kind is not None and getattr(param, _SLOT, _SLOT) is None:
            setattr(param, _SLOT, _Plain(kind))


def _plain_type(annotation: Any) -> Callable[[str], Any] | None:
    """Return what reads one value of a plain type, or of a list of them; else ``None``."""
    if get_origin(annotation) in {UnionType, Union}:
        inner = [one for one in get_args(annotation) if one is not type(None)]
        annotation = inner[0] if len(inner) == 1 else None
    if get_origin(annotation) is list:
        (annotation,) = get_args(annotation)
    return annotation if annotation in _WORDS else None


class _Plain:
    """Reads the values of one parameter; what typer asks where it would ask pydantic."""

    def __init__(self, kind: Callable[[str], Any]) -> None:
        self._kind = kind

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the value of what was written.

        Raises:
            BadParameter: It is none of the type.
        """
        if value is None:
            return () if param.multiple or param.nargs == -1 else None
        if isinstance(value, list | tuple):
            return [self._read(one, param, ctx) for one in value]
        return self._read(value, param, ctx)

    def _read(self, word: Any, param: Any, ctx: Any) -> Any:
        try:
            return self._kind(word)
        except ValueError as error:
            raise typer.BadParameter(
                f"'{word}' is no {_WORDS[self._kind]}",  # type: ignore[index]  # one of its keys
                ctx=ctx,
                param=param,
            ) from error
