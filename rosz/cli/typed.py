"""The commands as typer has them, which explains what is wrong with a line."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any, get_type_hints

import typer

from rosz.cli.declare import App, Argument, Command, Context, Option
from rosz.cli.light import make_light

__all__ = ("to_typer",)


def to_typer(app: App, context: Context) -> typer.Typer:
    """Return the same commands as an app of typer's.

    Args:
        app: The commands.
        context: What those get that ask for it.
    """
    made = typer.Typer(
        add_completion=False,
        add_help_option=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    if app.text:
        made.callback()(_nothing)  # without one, typer takes a group of one command for no group
    for name, command in app.commands.items():
        made.command(
            name or None,
            add_help_option=False,
            context_settings=_settings(command),
        )(_plain(command.function, context))
    make_light(made)
    return made


def _settings(command: Command) -> dict[str, Any]:
    settings: dict[str, Any] = {}
    if not command.interspersed:
        settings["allow_interspersed_args"] = False
    if command.tolerant:
        settings["ignore_unknown_options"] = True
    return settings


def _nothing() -> None: ...


def _plain(function: Callable[..., Any], context: Context) -> Callable[..., Any]:
    """Return a function whose signature is in typer's words, and that gets the context."""
    hints = get_type_hints(function, include_extras=True)
    contexts = {name: context for name, hint in hints.items() if hint is Context}
    kept = [
        one.replace(annotation=_in_words_of_typer(hints[one.name]))
        for one in inspect.signature(function).parameters.values()
        if one.name not in contexts
    ]

    def call(**values: Any) -> Any:
        return function(**values, **contexts)

    call.__name__ = function.__name__
    call.__doc__ = function.__doc__
    call.__annotations__ = {one.name: one.annotation for one in kept}
    call.__signature__ = inspect.Signature(kept)  # type: ignore[attr-defined]  # inspect reads it
    return call


def _in_words_of_typer(hint: Any) -> Any:
    (mark,) = hint.__metadata__
    if isinstance(mark, Argument):
        return Annotated[hint.__origin__, typer.Argument(metavar=mark.metavar)]
    assert isinstance(mark, Option)  # noqa: S101  # there is no third
    option = typer.Option(*mark.names, metavar=mark.metavar, hidden=mark.hidden)
    return Annotated[hint.__origin__, option]
