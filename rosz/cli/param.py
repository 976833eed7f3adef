"""``rosz param``: the commands of rosparam, and ``search`` and ``watch``."""

from __future__ import annotations

import re
import sys
import threading
import time
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

from rosz import names
from rosz.cli import suggest
from rosz.cli.call import Call
from rosz.cli.console import (
    count,
    print_error,
    print_json,
    print_json_line,
    print_lines,
    print_result,
    takes_escapes,
    until_stopped,
    warn,
    write_file,
)
from rosz.cli.declare import App, Argument, Json, Option, at_least, values_last
from rosz.errors import NotFoundError, ParamNotFound, RoszError, UsageError, YamlError

if TYPE_CHECKING:
    from rosz.introspect import ParameterTree
    from rosz.params import Change, Difference, Value
    from rosz.params import Path as ParamPath
    from rosz.params.replica import Changed, Outcome

_TOOL = "rosparam"
_STDIN = "<stdin>"
_PROGRESS_EVERY = 1.0

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
_Gone = Annotated[bool, Option("--gone", "Only those below names of nodes that are not alive.")]


@app.command("list")
def list_command(
    call: Call,
    namespace: Annotated[
        str | None, Argument("NAMESPACE", "Lists all if omitted.", suggest.params)
    ] = None,
    *,
    gone: _Gone = False,
    json: Json = False,
) -> None:
    """List parameters."""
    with _client(call) as client:
        space = _space(call, namespace)
        names = sorted(_gone(call, client, space).values()) if gone else client.names()
        inside = [name for name in names if name.startswith(space)]
    print_result(["\n".join(inside)] if inside or not gone else [], inside, as_json=json)


@app.command("get")
def get_command(
    call: Call,
    name: _Name,
    *,
    readable: Annotated[bool, Option("-p", "Print for reading; it may not be valid YAML.")] = False,
    verbose: _Verbose = False,
    json: Json = False,
) -> None:
    """Print a parameter, or all parameters below a namespace, as YAML."""
    with _client(call) as client:
        full = _resolve(call, name)
        _log(verbose, [f"getting parameter [{full}]"])
        value = client.get(full)
    if json:
        print_json(value)
    else:
        text = _format_scalar(value)
        if not text:
            from rosz.params.yaml import format_get, pretty

            text = pretty(value) if readable else format_get(value)
        sys.stdout.write(text)


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
        content = _read_value(value, text_file, binary_file)
        changes = condense(spread(full, normalise(content, full)))
        _warn_slow(client, client.write(changes))
    _log(verbose, (f"set parameter [/{'/'.join(path)}] to [{item}]" for path, item in changes))


@app.command("delete")
def delete_command(
    call: Call,
    name: Annotated[
        str | None, Argument("NAME", "With --gone, it may be omitted.", suggest.params)
    ] = None,
    *,
    gone: _Gone = False,
    yes: Annotated[bool, Option("-y --yes", "With --gone, do not ask.")] = False,
    verbose: _Verbose = False,
) -> int:
    """Delete a parameter and all parameters below it."""
    if name is None and not gone:
        raise UsageError("no parameter is given; expected a NAME, or --gone")
    if yes and not gone:
        raise UsageError("--yes is for --gone: deleting a parameter by its name asks nothing")
    with _client(call, "parameter") as client:
        if gone:
            return _delete_gone(call, client, name, yes=yes, verbose=verbose)
        full = _resolve(call, name or "")
        _warn_slow(client, client.delete(full))
    what = "ENTIRE parameter server" if full == "/" else f"parameter [{full}]"
    _log(verbose, [f"deleted {what}"])
    return 0


def _delete_gone(
    call: Call, client: ParameterTree, namespace: str | None, *, yes: bool, verbose: bool
) -> int:
    """Delete the parameters of nodes that are gone, once the user has agreed."""
    from rosz.params import DELETED, lookup, split

    space = _space(call, namespace)
    gone = _gone(call, client, space)
    names = sorted(gone.values())
    if call.incomplete:
        raise UsageError(
            "not all machines are reached, so nodes there may be alive; nothing is deleted"
        )
    if names and not yes:
        if not sys.stdin.isatty():
            raise UsageError(
                f"{len(names)} parameters would be deleted, and nobody can be asked: look at"
                " 'rosz param list --gone', then give --yes"
            )
        print_lines(names)
        print_error(
            "No node with the beginning of these names is alive. Parameters that several nodes"
            " share look the same."
        )
        sys.stderr.write(f"Delete these {len(names)} parameters? [y/N] ")
        sys.stderr.flush()
        if sys.stdin.readline().strip().lower() not in {"y", "yes"}:
            print_error("nothing is deleted")
            return 1
    top = split(space)
    left = _covering(lookup(client.store.get("/"), top), top, gone)
    _warn_slow(client, client.store.write([(path, DELETED) for path in left]))
    _log(verbose, (f"deleted parameter [{name}]" for name in names))
    return 0


def _space(call: Call, namespace: str | None) -> str:
    """Return the resolved name of a namespace, by default the root, with a slash at its end."""
    return "/" if namespace is None else _resolve(call, namespace).rstrip("/") + "/"


def _gone(call: Call, client: ParameterTree, space: str) -> dict[ParamPath, str]:
    """Return the paths below names of nodes of which none is alive, with their names.

    A parameter in the root belongs to no node. A namespace without parameters, which ROS 1 leaves
    when the last one is deleted, has a name that ends with a slash.
    """
    from rosz.params import ends, joined

    alive = {f"{token.node_name}/" for token in call.survey().view.tokens}
    return {
        path: name
        for path, value in ends(client.store.get("/"))
        if path
        and (name := joined(path) + "/" * (value == {})).startswith(space)
        and name.count("/") > 1
        and not any(name.startswith(node) for node in alive)
    }


def _covering(value: Value, path: ParamPath, paths: Container[ParamPath]) -> Iterator[ParamPath]:
    """Yield the topmost paths that hold nothing but given ones, so that no namespace stays."""
    from rosz.params import ends

    if path and all(below in paths for below, _ in ends(value, path)):
        yield path
    elif type(value) is dict:
        for key, item in value.items():
            yield from _covering(item, (*path, key), paths)


@app.command("dump")
def dump_command(
    call: Call,
    file: Annotated[str, Argument("FILE", "'-' or none is standard output.", suggest.files)] = "",
    namespace: _Space = "",
    *,
    verbose: _Verbose = False,
    json: Json = False,
) -> None:
    """Write parameters to a file as YAML."""
    from rosz.params import leaves, split
    from rosz.params.yaml import dump

    with _client(call) as client:
        full = _resolve(call, namespace)
        _log(verbose, [f"dumping namespace [{namespace}] to file [{file or None}]"])
        value = client.get(full)
    _log(verbose, _format_leaves(value, leaves(value, split(full))))
    if json:
        print_json(value)
    elif file in {"", "-"}:
        sys.stdout.write(dump(value))
    else:
        _check_target(file)
        write_file(file, dump(value).encode())


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
    with _Progress(f"reading {source}") as progress, _client(call) as client:
        _log(verbose, [f"reading parameters from {'stdin' if file == '-' else f'[{file}]'}"])
        own = _resolve(call, namespace)
        documents = load_documents(text, own, source)
        spaces = (space for space, _ in documents if space != own)
        _log(verbose, (f"reading parameters into namespace [{space}]" for space in spaces))
        set_by = [list(spread(space, value)) for space, value in documents]
        changes = condense(change for each in set_by for change in each)
        differences = preview(client.get("/"), changes) if dry_run else []
        loading = f"loading {count(len(changes), 'parameter')}"
        progress.text = loading

        def on_progress(holders: int, waiting: list[str]) -> None:
            others = f", waiting for {', '.join(waiting)}" if waiting else ""
            progress.text = f"{loading}, known to {count(holders, 'replica')}{others}"

        outcome = None if dry_run else client.write(changes, on_progress)
    if outcome is None:
        print_result(map(_change_line, differences), differences, as_json=json)
        if not json:
            print_error(f"{len(differences)} parameters would change; nothing is written")
        return
    _warn_slow(client, outcome)
    for (_, value), each in zip(documents, set_by, strict=True):
        _log(verbose, _format_leaves(value, each))


class _Progress:
    """A line on a terminal that tells what a command does, if that takes longer than a second.

    Args:
        text: What it does.

    Attributes:
        text: What it does now.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._show, daemon=True)

    def __enter__(self) -> Self:
        if takes_escapes(sys.stderr):
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def _show(self) -> None:
        began = time.monotonic()
        while not self._ended.wait(_PROGRESS_EVERY):
            passed = time.monotonic() - began
            sys.stderr.write(f"\r\033[K{self.text} ({passed:.0f} s)")
            sys.stderr.flush()
        sys.stderr.write("\r\033[K")
        sys.stderr.flush()


@app.command("search")
def search_command(call: Call, name: _Name, namespace: _Space = "", *, json: Json = False) -> int:
    """Print the full name of a parameter, searched in a namespace and then in those above it."""
    with _client(call) as client:
        full = client.store.search(name, _resolve(call, namespace))
    print_result([] if full is None else [full], full, as_json=json)
    if full is None:
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

    from rosz.params.replica import ParamClient

    changes: SimpleQueue[Changed] = SimpleQueue()
    with until_stopped() as ready, call.context(lasting=True) as context:
        client = ParamClient(context.session, call.domain)
        full = _resolve(call, name)
        with client.follow() as follower, follower.watch(full, changes.put):
            ready()
            print_error(f"watching [{full}]; press Ctrl-C to end")
            for change in islice(iter(changes.get, None), count):
                if json:
                    print_json_line(change)
                else:
                    print_lines([_change_line(change)])


@contextmanager
def _client(call: Call, word: str = "Parameter") -> Iterator[ParameterTree]:
    """Open a client; say in rosparam's words that a parameter is not set."""
    from rosz.introspect import ParameterTree

    try:
        with call.session() as session:
            yield ParameterTree(session, call.domain, warn)
    except ParamNotFound as error:
        hint = str(error).partition(" is not set")[2]
        raise NotFoundError(f"{word} [{error.name}] is not set{hint}") from error


def _resolve(call: Call, name: str) -> str:
    from rosz.params import resolve

    return resolve(name, call.node_name(_TOOL))


def _read_value(value: str | None, text_file: str, binary_file: str) -> Value:
    if binary_file:
        return _read_bytes(binary_file, UsageError)
    if text_file:
        return _decode(_read_bytes(text_file, UsageError), text_file)
    word = value or ""
    scalar = _parse_scalar(word)
    if scalar is not None:
        return scalar
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


def _read_stdin() -> str:
    return _decode(sys.stdin.buffer.read(), _STDIN)


def _read_bytes(file: str, error: type[RoszError]) -> bytes:
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
    folder = Path(file).absolute().parent.resolve().parts
    if Path(file).is_symlink() and folder != ("/", "dev") and folder[:2] != ("/", "proc"):
        raise UsageError(f"'{file}' is a link to '{Path(file).readlink()}'; name the file itself")


def _change_line(change: Changed | Difference) -> str:
    from rosz.params.yaml import inline

    name, old, new = change.name, change.old, change.new
    if old is None:
        return f"+ {name}: {inline(new)}"
    if new is None:
        return f"- {name}: {inline(old)}"
    return f"~ {name}: {inline(old)} -> {inline(new)}"


def _format_leaves(value: Value, changes: Iterable[Change]) -> Iterator[str]:
    """Yield the lines in which rosparam lists a tree; a single value has no name there."""
    if not isinstance(value, dict):
        yield str(value)
    else:
        yield from (f"/{'/'.join(path)}={item}" for path, item in changes)


def _warn_slow(client: ParameterTree, outcome: Outcome) -> None:
    """Name the processes that have not applied a write, or do not answer at all."""
    if outcome.slow:
        warn(f"written, but not yet known to {', '.join(outcome.slow)}, which did not answer")
    for label in client.store.silent:
        warn(f"{label} does not answer")


def _log(verbose: bool, lines: Iterable[str]) -> None:
    """Print to standard output what ``-v`` asks for, as rosparam does."""
    if verbose:
        print_lines(lines)
