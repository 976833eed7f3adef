"""``rosz param``: the commands of rosparam, and ``search`` and ``watch``."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Annotated

from rosz import names
from rosz.cli import suggest
from rosz.cli.call import Call
from rosz.cli.console import (
    print_error,
    print_json,
    print_json_line,
    print_lines,
    print_result,
    until_stopped,
    warn,
    write_file,
)
from rosz.cli.declare import App, Argument, Json, Option, at_least, values_last
from rosz.errors import NotFoundError, ParamNotFound, RoszError, UsageError, YamlError

if TYPE_CHECKING:
    from rosz.params import Change, Difference, Value
    from rosz.params.remote import ParamClient
    from rosz.params.replica import Changed, Outcome

__all__ = ("app",)

_TOOL = "rosparam"
_STDIN = "<stdin>"

# Most values are written alike in YAML and in Python, and importing a YAML parser takes longer than
# getting or setting a value.
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_INTEGER = re.compile(r"0|-?[1-9][0-9]{0,17}", re.ASCII)
_FRACTION = re.compile(r"-?[0-9]{1,18}\.[0-9]{1,18}", re.ASCII)
_YAML_WORDS = frozenset({"yes", "no", "on", "off", "true", "false", "null", "y", "n"})


def _is_special(word: str) -> bool:
    left, separator, _ = word.partition(":=")
    return bool(separator) and left.startswith("__") and names.is_valid(left.lstrip("_"))


app = App("Get and set parameters.", is_remapping=_is_special)

_Verbose = Annotated[bool, Option("-v", "Print each step.")]
_Name = Annotated[str, Argument("NAME", source=suggest.params)]
_Space = Annotated[str, Argument("NAMESPACE", source=suggest.params)]


@app.command("list")
def list_command(
    call: Call,
    namespace: Annotated[
        str | None, Argument("NAMESPACE", "Lists all if omitted.", suggest.params)
    ] = None,
    *,
    json: Json = False,
) -> None:
    """List parameters."""
    with _client(call) as client:
        space = "/" if namespace is None else _resolve(call, namespace).rstrip("/") + "/"
        found = [name for name in client.names() if name.startswith(space)]
    if json:
        print_json(found)
    else:
        sys.stdout.write("\n".join(found) + "\n")


@app.command("get")
def get_command(
    call: Call,
    name: _Name,
    *,
    readable: Annotated[bool, Option("-p", "Print for reading; it may not be valid YAML.")] = False,
    verbose: _Verbose = False,
    json: Json = False,
) -> int:
    """Print a parameter, or all parameters below a namespace, as YAML."""
    with _client(call) as client:
        full = _resolve(call, name)
        _log(verbose, [f"getting parameter [{full}]"])
        try:
            value = client.get(full)
        except ParamNotFound as error:
            return _fail_not_set("Parameter", error)
    if json:
        print_json(value)
    else:
        sys.stdout.write(_format_scalar(value) or _format_yaml(value, readable=readable))
    return 0


@app.command("set", arrange=values_last("-t", "--textfile", "-b", "--binfile"))
def set_command(
    call: Call,
    name: _Name,
    value: Annotated[
        str | None, Argument("VALUE", "The value in YAML; '-' reads it from standard input.")
    ] = None,
    *,
    text_file: Annotated[
        str, Option("-t --textfile FILE", "Set it to the text in a file.", suggest.files)
    ] = "",
    binary_file: Annotated[
        str, Option("-b --binfile FILE", "Set it to the bytes in a file.", suggest.files)
    ] = "",
    verbose: _Verbose = False,
) -> None:
    """Set a parameter; a dict sets the parameters in it and keeps the others."""
    given = [word for word in (value, text_file or None, binary_file or None) if word is not None]
    if len(given) > 1:
        raise UsageError("a value, --textfile and --binfile exclude each other: give only one")
    if not given:
        raise UsageError("no value is given; expected one in YAML, or --textfile or --binfile")
    from rosz.params import condense, normalise, spread

    with _client(call) as client:
        full = _resolve(call, name)
        found = _read_value(value, text_file, binary_file)
        changes = condense(spread(full, normalise(found, full)))
        _warn_slow(client, client.write(changes))
    _log(verbose, (f"set parameter [/{'/'.join(path)}] to [{item}]" for path, item in changes))


@app.command("delete")
def delete_command(call: Call, name: _Name, *, verbose: _Verbose = False) -> int:
    """Delete a parameter and all parameters below it."""
    with _client(call) as client:
        full = _resolve(call, name)
        try:
            _warn_slow(client, client.delete(full))
        except ParamNotFound as error:
            return _fail_not_set("parameter", error)
    what = "ENTIRE parameter server" if full == "/" else f"parameter [{full}]"
    _log(verbose, [f"deleted {what}"])
    return 0


@app.command("dump")
def dump_command(
    call: Call,
    file: Annotated[str, Argument("FILE", "'-' or none is standard output.", suggest.files)] = "",
    namespace: _Space = "",
    *,
    verbose: _Verbose = False,
    json: Json = False,
) -> int:
    """Write parameters to a file as YAML."""
    from rosz.params import leaves, split
    from rosz.params.yaml import dump

    with _client(call) as client:
        full = _resolve(call, namespace)
        _log(verbose, [f"dumping namespace [{namespace}] to file [{file or None}]"])
        try:
            value = client.get(full)
        except ParamNotFound as error:
            return _fail_not_set("Parameter", error)
    _log(verbose, _format_leaves(value, leaves(value, split(full))))
    if json:
        print_json(value)
    elif file in {"", "-"}:
        sys.stdout.write(dump(value))
    else:
        _check_target(file)
        write_file(file, dump(value).encode())
    return 0


@app.command("load")
def load_command(
    call: Call,
    file: Annotated[str, Argument("FILE", "'-' is standard input.", suggest.files)],
    namespace: _Space = "",
    *,
    dry_run: Annotated[bool, Option("--dry-run", "Only print what would change.")] = False,
    verbose: _Verbose = False,
    json: Annotated[bool, Option("--json", "Print the result of --dry-run as JSON.")] = False,
) -> None:
    """Set parameters from a YAML file; if one of them is wrong, set none."""
    if json and not dry_run:
        raise UsageError("--json is for --dry-run: loading prints nothing")
    from rosz.params import condense, preview, spread
    from rosz.params.yaml import load_documents

    source = _STDIN if file == "-" else file
    text = _read_stdin() if file == "-" else _decode(_read_bytes(file, NotFoundError), file)
    with _client(call) as client:
        _log(verbose, [f"reading parameters from {'stdin' if file == '-' else f'[{file}]'}"])
        own = _resolve(call, namespace)
        documents = load_documents(text, own, source)
        spaces = (space for space, _ in documents if space != own)
        _log(verbose, (f"reading parameters into namespace [{space}]" for space in spaces))
        set_by = [list(spread(space, value)) for space, value in documents]
        changes = condense(change for each in set_by for change in each)
        if dry_run:
            _print_preview(preview(client.get("/"), changes), as_json=json)
            return
        _warn_slow(client, client.write(changes))
    for (_, value), each in zip(documents, set_by, strict=True):
        _log(verbose, _format_leaves(value, each))


@app.command("search")
def search_command(
    call: Call,
    name: _Name,
    namespace: _Space = "",
    *,
    json: Json = False,
) -> int:
    """Print the full name of a parameter, searched in a namespace and then in those above it."""
    with _client(call) as client:
        found = client.search(name, _resolve(call, namespace))
    print_result([] if found is None else [found], found, as_json=json)
    if found is None:
        print_error(f"ERROR: Cannot find parameter [{name}] in an upwards search")
        return 1
    return 0


@app.command("watch")
def watch_command(
    call: Call,
    name: _Name,
    *,
    count: Annotated[int | None, Option("-n COUNT", "Stop after this number of changes.")] = None,
    json: Json = False,
) -> None:
    """Print changes of a parameter, or of all parameters in a namespace, as they happen."""
    at_least("-n", count, 1, "changes")
    from queue import SimpleQueue

    from rosz.params.remote import ParamClient

    changes: SimpleQueue[Changed] = SimpleQueue()
    with until_stopped() as ready, call.context(lasting=True) as context:
        client = ParamClient(context.session, call.domain)
        full = _resolve(call, name)
        with client.follow() as follower, follower.watch(full, changes.put):
            ready()
            print_error(f"watching [{full}]; press Ctrl-C to end")
            for change in islice(iter(changes.get, None), count):
                _print_change(change, as_json=json)


@contextmanager
def _client(call: Call) -> Iterator[ParamClient]:
    from rosz.params.remote import ParamClient

    with call.session() as session:
        yield ParamClient(session, call.domain)


def _resolve(call: Call, name: str) -> str:
    from rosz.params import resolve

    return resolve(name, call.node_name(_TOOL))


def _read_value(value: str | None, text_file: str, binary_file: str) -> Value:
    """Return the value to set."""
    if binary_file:
        return _read_bytes(binary_file, UsageError)
    if text_file:
        return _decode(_read_bytes(text_file, UsageError), text_file)
    word = value or ""
    found = _parse_scalar(word)
    if found is not None:
        return found
    from rosz.params.yaml import load

    return load(_read_stdin(), _STDIN) if word == "-" else load(word, "<value>")


def _parse_scalar(word: str) -> Value | None:
    """Return the value of a word that needs no YAML parser; ``None`` for any other word."""
    if _INTEGER.fullmatch(word):
        return int(word)
    if _FRACTION.fullmatch(word):
        return float(word)
    if word in {"true", "false"}:
        return word == "true"
    return word if _WORD.fullmatch(word) and word.lower() not in _YAML_WORDS else None


def _format_scalar(value: Value) -> str:
    """Return the line for a value that needs no YAML; empty for any other value."""
    if isinstance(value, bool):
        return f"{value}\n".lower()
    if isinstance(value, int) or (isinstance(value, str) and _WORD.fullmatch(value)):
        return f"{value}\n" if str(value).lower() not in _YAML_WORDS else ""
    return ""


def _format_yaml(value: Value, *, readable: bool) -> str:
    from rosz.params.yaml import format_get, pretty

    return pretty(value) if readable else format_get(value)


def _read_stdin() -> str:
    return _decode(sys.stdin.buffer.read(), _STDIN)


def _read_bytes(file: str, error: type[RoszError]) -> bytes:
    from pathlib import Path

    if not Path(file).is_file():
        what = "is not a regular file" if Path(file).exists() else "does not exist"
        raise error(f"file '{file}' {what}")
    return Path(file).read_bytes()


def _decode(content: bytes, file: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        reason = f"byte {content[error.start]:#04x} is not UTF-8; save the file as UTF-8"
        raise YamlError(reason, file, line) from error


def _check_target(file: str) -> None:
    """Refuse to write through a link, which somebody else may have put there.

    Links of the system, such as ``/dev/stdout`` and those to the pipes of a shell, are followed.
    """
    from pathlib import Path

    folder = Path(file).absolute().parent.resolve().parts
    if Path(file).is_symlink() and folder != ("/", "dev") and folder[:2] != ("/", "proc"):
        raise UsageError(f"'{file}' is a link to '{Path(file).readlink()}'; name the file itself")


def _print_preview(differences: list[Difference], *, as_json: bool) -> None:
    lines = (_change_line(found.name, found.old, found.new) for found in differences)
    print_result(lines, differences, as_json=as_json)
    if not as_json:
        print_error(f"{len(differences)} parameters would change; nothing is written")


def _print_change(change: Changed, *, as_json: bool) -> None:
    if as_json:
        print_json_line(change)
    else:
        print_lines([_change_line(change.name, change.old, change.new)])


def _change_line(name: str, old: Value | None, new: Value | None) -> str:
    from rosz.params.yaml import inline

    if old is None:
        return f"+ {name}: {inline(new)}"
    if new is None:
        return f"- {name}: {inline(old)}"
    return f"~ {name}: {inline(old)} -> {inline(new)}"


def _fail_not_set(word: str, error: ParamNotFound) -> int:
    """Print in rosparam's words that a parameter is not set, and return the exit code."""
    hint = str(error).partition(" is not set")[2]
    print_error(f"ERROR: {word} [{error.name}] is not set{hint}")
    return 1


def _format_leaves(value: Value, changes: Iterable[Change]) -> Iterator[str]:
    """Yield the lines in which rosparam lists a tree; a single value has no name there."""
    if not isinstance(value, dict):
        yield str(value)
    else:
        yield from (f"/{'/'.join(path)}={item}" for path, item in changes)


def _warn_slow(client: ParamClient, outcome: Outcome) -> None:
    """Name the processes that have not applied a write, or do not answer at all."""
    if outcome.slow:
        warn(f"written, but not yet known to {', '.join(outcome.slow)}, which did not answer")
    for label in client.silent:
        warn(f"{label} does not answer")


def _log(verbose: bool, lines: Iterable[str]) -> None:
    """Print to standard output what ``-v`` asks for, as rosparam does."""
    if verbose:
        print_lines(lines)
