"""Run a command line with typer, which writes help and explains faults of a line."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from rosz.cli.declare import App, Argument, Command, CommandParameter, Option
from rosz.errors import UsageError

_NUMBERS: dict[Any, str] = {int: "integer", float: "number"}
_SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


def run(app: App, argv: Sequence[str], program: str) -> Any:
    """Run a command line, and return the result of its command.

    Raises:
        UsageError: The command line is wrong.
        KeyboardInterrupt: Ctrl-C was pressed.
        BrokenPipeError: Nobody reads the output any more.
    """
    remappings, words = app.split(argv)
    try:
        return translate(app, remappings)(args=words, prog_name=program, standalone_mode=False)
    except typer.Abort as error:
        raise KeyboardInterrupt from error
    except SystemExit as error:  # typer raises it here for a broken pipe only
        raise BrokenPipeError from error
    except TyperException as error:
        if app.help and words and words[0] in app.commands:
            program += f" {words[0]}"
        raise UsageError(_reword(error.format_message(), program) + _usage(error)) from error


def _usage(error: TyperException) -> str:
    """Return the usage of a command that was run by its name of ROS 1, whose tools print it."""
    context: Any = getattr(error, "ctx", None)
    if context is None or context.command_path.startswith("rosz "):
        return ""
    return f"\n{context.get_usage()}"


class _Group(TyperGroup):
    """A group that lists its commands as ROS 1's tools do, when it has the name of one of them."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        name = ctx.command_path
        if name.startswith("rosz "):
            super().format_commands(ctx, formatter)
            return
        rows = [(f"{name} {own}", made.get_short_help_str()) for own, made in self.commands.items()]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def _reword(text: str, program: str) -> str:
    """Return an error text of typer in the form of the other errors."""
    text = text[:1].lower() + text[1:].rstrip(".").replace(". Did you mean", "; did you mean")
    if text.startswith("no such option: -") and text[-1:].isdigit():
        text += "; write '--' before a negative value"
    return text if text.endswith("?") else f"{text}; see '{program} --help'"


def translate(app: App, remappings: Sequence[str]) -> typer.Typer:
    """Return the app as typer declares it."""
    made = typer.Typer(
        cls=_Group,
        help=app.help or None,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings=_SETTINGS,
    )
    if app.help:
        # Without a callback, one command alone is not a group for typer.
        made.callback()(lambda: None)
    for name, command in app.commands.items():
        made.command(
            name or None,
            help=command.help,
            short_help=" ".join(command.help.partition("\n\n")[0].split()),
            context_settings={
                **_SETTINGS,
                "allow_interspersed_args": command.interspersed,
                "ignore_unknown_options": command.tolerant,
            },
        )(_typed(command, remappings))
    return made


def _typed(command: Command, remappings: Sequence[str]) -> Callable[..., Any]:
    def call(**values: Any) -> Any:
        return command.run(values, remappings)

    parameters = [_translate(parameter) for parameter in command.parameters()]
    call.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # for inspect
    return call


def _translate(parameter: CommandParameter) -> inspect.Parameter:
    return inspect.Parameter(
        parameter.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if parameter.required else parameter.default,
        annotation=Annotated[parameter.hint, _declare(parameter.kind, parameter.mark)],
    )


def _declare(kind: Callable[[Any], Any], mark: Argument | Option) -> Any:
    def parse(word: Any) -> Any:
        try:
            return kind(word)
        except ValueError as error:
            raise typer.BadParameter(f"'{word}' is not a valid {_NUMBERS[kind]}") from error

    parser = parse if kind in _NUMBERS else None
    if isinstance(mark, Argument):
        return typer.Argument(metavar=mark.metavar, help=mark.help, parser=parser)
    return typer.Option(
        *mark.names, metavar=mark.metavar, help=mark.help, hidden=mark.help is None, parser=parser
    )
