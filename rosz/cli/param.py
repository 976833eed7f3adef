"""``rosz param``: what rosparam does, and searching and watching."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rosz import names, remap
from rosz.cli.group import print_json, print_lines, until_stopped, warn
from rosz.cli.light import LightCommand, LightGroup
from rosz.errors import NotFoundError, ParamNotFound, RoszError, UsageError, YamlError

if TYPE_CHECKING:
    from rosz.params import Value
    from rosz.params.preview import Difference
    from rosz.params.remote import ParamClient
    from rosz.params.replica import Changed, Outcome

__all__ = ("app",)

_TOOL = "rosparam"
_FAILED = 1
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_YAML_WORDS = frozenset({"yes", "no", "on", "off", "true", "false", "null", "y", "n"})


class _Group(LightGroup):
    """Takes ``__ns:=`` and its like out of the arguments; all else may be a value."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        ctx.obj = tuple(filter(_is_special, args))
        return super().parse_args(ctx, [word for word in args if not _is_special(word)])


class _SetCommand(LightCommand):
    """Takes ``-1`` for a value and not for an option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        options: list[str] = []
        values: list[str] = []
        words = iter(args)
        for word in words:
            if word == "--":
                values += words
            elif word in {"-t", "--textfile", "-b", "--binfile"}:
                options += [word, *islice(words, 1)]
            elif word.startswith("-") and word != "-" and not word[1:2].isdigit():
                options.append(word)
            else:
                values.append(word)
        return super().parse_args(ctx, [*options, "--", *values])


def _is_special(word: str) -> bool:
    left, separator, _ = word.partition(":=")
    return bool(separator) and left.startswith("__") and names.is_valid(left.lstrip("_"))


app = typer.Typer(
    cls=_Group,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Get and set parameters.",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

_Verbose = Annotated[bool, typer.Option("-v", help="Tell what is done, on stderr.")]
_Json = Annotated[bool, typer.Option("--json", help="As JSON.")]
_Name = Annotated[str, typer.Argument(metavar="NAME")]
_Space = Annotated[str, typer.Argument(metavar="[NAMESPACE]")]


@app.command("list")
def list_command(
    context: typer.Context,
    namespace: Annotated[
        str | None, typer.Argument(metavar="[NAMESPACE]", help="All when not given.")
    ] = None,
    *,
    json: _Json = False,
) -> None:
    """List parameters."""
    with _client(context) as (client, resolve):
        space = "/" if namespace is None else resolve(namespace).rstrip("/") + "/"
        found = [name for name in client.names() if name.startswith(space)]
    if json:
        print_json(found)
    else:
        sys.stdout.write("\n".join(found) + "\n")


@app.command("get")
def get_command(
    context: typer.Context,
    name: _Name,
    *,
    readable: Annotated[
        bool, typer.Option("-p", help="For reading; it may not be YAML any more.")
    ] = False,
    verbose: _Verbose = False,
    json: _Json = False,
) -> int:
    """Print a parameter, or all below a namespace, as YAML."""
    with _client(context) as (client, resolve):
        full = resolve(name)
        _tell(verbose, f"getting parameter [{full}]")
        try:
            value = client.get(full)
        except ParamNotFound as error:
            return _not_set("Parameter", error)
    if json:
        print_json(value)
    else:
        sys.stdout.write(_plain(value) or _as_yaml(value, readable=readable))
    return 0


def _plain(value: Value) -> str:
    """Return a value that is the same in YAML and in Python, without what loads for YAML."""
    if isinstance(value, bool):
        return f"{value}\n".lower()
    if isinstance(value, int) or (isinstance(value, str) and _WORD.fullmatch(value)):
        return f"{value}\n" if str(value).lower() not in _YAML_WORDS else ""
    return ""


def _as_yaml(value: Value, *, readable: bool) -> str:
    from rosz.params.yaml import format_get, pretty

    return pretty(value) if readable else format_get(value)


@app.command("set", cls=_SetCommand)
def set_command(
    context: typer.Context,
    name: _Name,
    value: Annotated[
        str | None, typer.Argument(metavar="[VALUE]", help="YAML; - reads it from stdin.")
    ] = None,
    *,
    text_file: Annotated[
        str, typer.Option("-t", "--textfile", metavar="FILE", help="Set to the text in a file.")
    ] = "",
    binary_file: Annotated[
        str, typer.Option("-b", "--binfile", metavar="FILE", help="Set to the bytes in a file.")
    ] = "",
    verbose: _Verbose = False,
) -> None:
    """Set a parameter; a dict sets what it holds and leaves the rest."""
    given = [word for word in (value, text_file or None, binary_file or None) if word is not None]
    if len(given) > 1:
        raise UsageError("a value, --textfile and --binfile exclude each other: give only one")
    if not given:
        raise UsageError("no value is given; expected one in YAML, or --textfile or --binfile")
    from rosz.params import condense, normalise, spread

    with _client(context) as (client, resolve):
        full = resolve(name)
        found = _read_value(value, text_file, binary_file)
        changes = condense(spread(full, normalise(found, full)))
        _tell_slow(client, client.write(changes))
    for path, item in changes:
        _tell(verbose, f"set parameter [/{'/'.join(path)}] to [{item}]")


@app.command("delete")
def delete_command(context: typer.Context, name: _Name, *, verbose: _Verbose = False) -> int:
    """Delete a parameter and all below it."""
    with _client(context) as (client, resolve):
        full = resolve(name)
        try:
            _tell_slow(client, client.delete(full))
        except ParamNotFound as error:
            return _not_set("parameter", error)
    _tell(verbose, "deleted all parameters" if full == "/" else f"deleted parameter [{full}]")
    return 0


@app.command("dump")
def dump_command(
    context: typer.Context,
    file: Annotated[
        str, typer.Argument(metavar="[FILE]", help="stdout when not given, or -.")
    ] = "",
    namespace: _Space = "",
    *,
    verbose: _Verbose = False,
    json: _Json = False,
) -> int:
    """Write parameters to a file as YAML."""
    from pathlib import Path

    from rosz.params.yaml import dump

    with _client(context) as (client, resolve):
        full = resolve(namespace)
        _tell(verbose, f"dumping namespace [{full}] to file [{file}]")
        try:
            value = client.get(full)
        except ParamNotFound as error:
            return _not_set("Parameter", error)
    if json:
        print_json(value)
    elif file in {"", "-"}:
        sys.stdout.write(dump(value))
    else:
        _check_target(file)
        Path(file).write_text(dump(value), encoding="utf-8")
    return 0


@app.command("load")
def load_command(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="- is stdin.")],
    namespace: _Space = "",
    *,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Tell what would change, and change nothing.")
    ] = False,
    verbose: _Verbose = False,
    json: Annotated[bool, typer.Option("--json", help="The dry run's answer as JSON.")] = False,
) -> None:
    """Set parameters from a YAML file, all of them or, where one is wrong, none."""
    if json and not dry_run:
        raise UsageError("--json is for --dry-run: loading prints nothing")
    from rosz.params import condense, spread
    from rosz.params.preview import preview
    from rosz.params.yaml import load_documents

    text, source = _read_text(file)
    with _client(context) as (client, resolve):
        _tell(verbose, f"reading parameters from [{source}]")
        documents = load_documents(text, resolve(namespace), source)
        changes = condense(change for space, value in documents for change in spread(space, value))
        if dry_run:
            _show(preview(client.get("/"), changes), as_json=json)
            return
        _tell_slow(client, client.write(changes))
    for path, item in changes:
        _tell(verbose, f"set parameter [/{'/'.join(path)}] to [{item}]")


@app.command("search")
def search_command(
    context: typer.Context,
    name: _Name,
    namespace: _Space = "",
    *,
    json: _Json = False,
) -> int:
    """Look for a parameter in a namespace, or node, and then upwards; print its full name."""
    with _client(context) as (client, resolve):
        found = client.search(name, resolve(namespace))
    if json:
        print_json(found)
    elif found is not None:
        print_lines([found])
    if found is None:
        _complain(f"ERROR: Cannot find parameter [{name}] in an upwards search")
        return _FAILED
    return 0


@app.command("watch")
def watch_command(
    context: typer.Context,
    name: _Name,
    *,
    count: Annotated[
        int | None, typer.Option("-n", metavar="COUNT", help="End after so many changes.")
    ] = None,
    json: _Json = False,
) -> None:
    """Print changes of a parameter, or of all in a namespace, as they come."""
    if count is not None and count < 1:
        raise UsageError(f"-n is {count}; expected at least 1")
    from queue import SimpleQueue

    changes: SimpleQueue[Changed] = SimpleQueue()
    with until_stopped() as ready, _client(context, lasting=True) as (client, resolve):
        full = resolve(name)
        with client.follow() as follower, follower.watch(full, changes.put):
            ready()
            _complain(f"watching [{full}]; press Ctrl-C to end")
            left = count
            while left is None or left > 0:
                _print_change(changes.get(), as_json=json)
                left = None if left is None else left - 1


@contextmanager
def _client(
    context: typer.Context, *, lasting: bool = False
) -> Iterator[tuple[ParamClient, Callable[[str], str]]]:
    """Give the way to the store, and what turns names into global ones."""
    from rosz.environment import Environment
    from rosz.introspect.reach import open_context, open_session
    from rosz.params.paths import resolve
    from rosz.params.remote import ParamClient

    environment = Environment.read()
    argv = context.find_object(tuple) or ()
    node = remap.parse(argv).node_name(_TOOL, environment.namespace)
    with ExitStack() as stack:
        if lasting:
            session = stack.enter_context(open_context(environment, argv, lasting=True)).session
        else:
            session = stack.enter_context(open_session(environment))
        yield ParamClient(session, environment.domain), lambda name: resolve(name, node)


def _read_value(value: str | None, text_file: str, binary_file: str) -> Value:
    """Return what is to be set, from wherever it is."""
    from rosz.params.yaml import load

    if binary_file:
        return _bytes(binary_file, UsageError)
    if text_file:
        return _text(_bytes(text_file, UsageError), text_file)
    if value == "-":
        return load(sys.stdin.read(), "<stdin>")
    return load(value or "", "<value>")


def _read_text(file: str) -> tuple[str, str]:
    """Return a text to load, and what to call it."""
    if file == "-":
        return sys.stdin.read(), "<stdin>"
    return _text(_bytes(file, NotFoundError), file), file


def _check_target(file: str) -> None:
    """Refuse to write through a link, by which somebody else could have a file overwritten."""
    from pathlib import Path

    if Path(file).is_symlink():
        raise UsageError(f"'{file}' is a link to '{Path(file).readlink()}'; name the file itself")


def _bytes(file: str, error: type[RoszError]) -> bytes:
    from pathlib import Path

    if not Path(file).is_file():
        what = "is no regular file" if Path(file).exists() else "does not exist"
        raise error(f"file '{file}' {what}")
    return Path(file).read_bytes()


def _text(content: bytes, file: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        reason = f"byte {content[error.start]:#04x} is no UTF-8; save the file as UTF-8"
        raise YamlError(reason, file, line) from error


def _show(differences: list[Difference], *, as_json: bool) -> None:
    """Print what a load would do."""
    if as_json:
        print_json(differences)
        return
    print_lines(_line(found.name, found.old, found.new) for found in differences)
    _complain(f"{len(differences)} parameters would change; nothing is written")


def _print_change(change: Changed, *, as_json: bool) -> None:
    if as_json:
        import msgspec

        print_lines([msgspec.json.encode(change).decode()])
    else:
        print_lines([_line(change.name, change.old, change.new)])


def _line(name: str, old: Value | None, new: Value | None) -> str:
    from rosz.params.yaml import inline

    if old is None:
        return f"+ {name}: {inline(new)}"
    if new is None:
        return f"- {name}: {inline(old)}"
    return f"~ {name}: {inline(old)} -> {inline(new)}"


def _not_set(word: str, error: ParamNotFound) -> int:
    """Say in ROS 1's words that something is not set."""
    hint = str(error).partition(" is not set")[2]
    _complain(f"ERROR: {word} [{error.name}] is not set{hint}")
    return _FAILED


def _tell_slow(client: ParamClient, outcome: Outcome) -> None:
    """Name the processes that have not heard of a write, or do not answer at all."""
    if outcome.slow:
        warn(f"written, but not yet known to {', '.join(outcome.slow)}, which did not answer")
    for label in client.silent:
        warn(f"{label} does not answer")


def _tell(verbose: bool, text: str) -> None:
    if verbose:
        _complain(text)


def _complain(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()
