"""``rosz param``: what rosparam does, and searching and watching."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated

from rosz import names, remap
from rosz.cli.bounds import at_least
from rosz.cli.declare import App, Argument, Context, Option, values_last
from rosz.cli.group import print_json, print_lines, until_stopped, write_file
from rosz.cli.param_plain import plain
from rosz.cli.param_show import (
    as_yaml,
    complain,
    not_set,
    print_change,
    show_preview,
    tell,
    tell_slow,
)
from rosz.errors import ParamNotFound, UsageError

if TYPE_CHECKING:
    from rosz.params.remote import ParamClient
    from rosz.params.replica import Changed

__all__ = ("app",)

_TOOL = "rosparam"
_FAILED = 1
_TAKING = frozenset({"-t", "--textfile", "-b", "--binfile"})


def _is_special(word: str) -> bool:
    left, separator, _ = word.partition(":=")
    return bool(separator) and left.startswith("__") and names.is_valid(left.lstrip("_"))


app = App("Get and set parameters.", remapped=_is_special)

_Verbose = Annotated[bool, Option("-v", help="Tell what is done, on stderr.")]
_Json = Annotated[bool, Option("--json", help="As JSON.")]
_Name = Annotated[str, Argument(metavar="NAME")]
_Space = Annotated[str, Argument(metavar="[NAMESPACE]")]


@app.command("list")
def list_command(
    context: Context,
    namespace: Annotated[
        str | None, Argument(metavar="[NAMESPACE]", help="All when not given.")
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
    context: Context,
    name: _Name,
    *,
    readable: Annotated[
        bool, Option("-p", help="For reading; it may not be YAML any more.")
    ] = False,
    verbose: _Verbose = False,
    json: _Json = False,
) -> int:
    """Print a parameter, or all below a namespace, as YAML."""
    with _client(context) as (client, resolve):
        full = resolve(name)
        tell(verbose, f"getting parameter [{full}]")
        try:
            value = client.get(full)
        except ParamNotFound as error:
            return not_set("Parameter", error)
    if json:
        print_json(value)
    else:
        sys.stdout.write(plain(value) or as_yaml(value, readable=readable))
    return 0


@app.command("set", arrange=values_last(_TAKING))
def set_command(
    context: Context,
    name: _Name,
    value: Annotated[
        str | None, Argument(metavar="[VALUE]", help="YAML; - reads it from stdin.")
    ] = None,
    *,
    text_file: Annotated[
        str, Option("-t", "--textfile", metavar="FILE", help="Set to the text in a file.")
    ] = "",
    binary_file: Annotated[
        str, Option("-b", "--binfile", metavar="FILE", help="Set to the bytes in a file.")
    ] = "",
    verbose: _Verbose = False,
) -> None:
    """Set a parameter; a dict sets what it holds and leaves the rest."""
    given = [word for word in (value, text_file or None, binary_file or None) if word is not None]
    if len(given) > 1:
        raise UsageError("a value, --textfile and --binfile exclude each other: give only one")
    if not given:
        raise UsageError("no value is given; expected one in YAML, or --textfile or --binfile")
    from rosz.cli.param_files import read_value
    from rosz.params import condense, normalise, spread

    with _client(context) as (client, resolve):
        full = resolve(name)
        found = read_value(value, text_file, binary_file)
        changes = condense(spread(full, normalise(found, full)))
        tell_slow(client, client.write(changes))
    for path, item in changes:
        tell(verbose, f"set parameter [/{'/'.join(path)}] to [{item}]")


@app.command("delete")
def delete_command(context: Context, name: _Name, *, verbose: _Verbose = False) -> int:
    """Delete a parameter and all below it."""
    with _client(context) as (client, resolve):
        full = resolve(name)
        try:
            tell_slow(client, client.delete(full))
        except ParamNotFound as error:
            return not_set("parameter", error)
    tell(verbose, "deleted all parameters" if full == "/" else f"deleted parameter [{full}]")
    return 0


@app.command("dump")
def dump_command(
    context: Context,
    file: Annotated[str, Argument(metavar="[FILE]", help="stdout when not given, or -.")] = "",
    namespace: _Space = "",
    *,
    verbose: _Verbose = False,
    json: _Json = False,
) -> int:
    """Write parameters to a file as YAML."""
    from rosz.params.yaml import dump

    with _client(context) as (client, resolve):
        full = resolve(namespace)
        tell(verbose, f"dumping namespace [{full}] to file [{file}]")
        try:
            value = client.get(full)
        except ParamNotFound as error:
            return not_set("Parameter", error)
    if json:
        print_json(value)
    elif file in {"", "-"}:
        sys.stdout.write(dump(value))
    else:
        from rosz.cli.param_files import check_target

        check_target(file)
        write_file(file, dump(value).encode())
    return 0


@app.command("load")
def load_command(
    context: Context,
    file: Annotated[str, Argument(metavar="FILE", help="- is stdin.")],
    namespace: _Space = "",
    *,
    dry_run: Annotated[
        bool, Option("--dry-run", help="Tell what would change, and change nothing.")
    ] = False,
    verbose: _Verbose = False,
    json: Annotated[bool, Option("--json", help="The dry run's answer as JSON.")] = False,
) -> None:
    """Set parameters from a YAML file, all of them or, where one is wrong, none."""
    if json and not dry_run:
        raise UsageError("--json is for --dry-run: loading prints nothing")
    from rosz.cli.param_files import read_text
    from rosz.params import condense, spread
    from rosz.params.tree import preview
    from rosz.params.yaml import load_documents

    text, source = read_text(file)
    with _client(context) as (client, resolve):
        tell(verbose, f"reading parameters from [{source}]")
        documents = load_documents(text, resolve(namespace), source)
        changes = condense(change for space, value in documents for change in spread(space, value))
        if dry_run:
            show_preview(preview(client.get("/"), changes), as_json=json)
            return
        tell_slow(client, client.write(changes))
    for path, item in changes:
        tell(verbose, f"set parameter [/{'/'.join(path)}] to [{item}]")


@app.command("search")
def search_command(
    context: Context,
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
        complain(f"ERROR: Cannot find parameter [{name}] in an upwards search")
        return _FAILED
    return 0


@app.command("watch")
def watch_command(
    context: Context,
    name: _Name,
    *,
    count: Annotated[
        int | None, Option("-n", metavar="COUNT", help="End after so many changes.")
    ] = None,
    json: _Json = False,
) -> None:
    """Print changes of a parameter, or of all in a namespace, as they come."""
    if count is not None:
        at_least("-n", count, 1, "changes")
    from queue import SimpleQueue

    changes: SimpleQueue[Changed] = SimpleQueue()
    with until_stopped() as ready, _client(context, lasting=True) as (client, resolve):
        full = resolve(name)
        with client.follow() as follower, follower.watch(full, changes.put):
            ready()
            complain(f"watching [{full}]; press Ctrl-C to end")
            left = count
            while left is None or left > 0:
                print_change(changes.get(), as_json=json)
                left = None if left is None else left - 1


@contextmanager
def _client(
    context: Context, *, lasting: bool = False
) -> Iterator[tuple[ParamClient, Callable[[str], str]]]:
    """Give the way to the store, and what turns names into global ones."""
    from rosz.environment import Environment
    from rosz.introspect.connect import open_context, open_session
    from rosz.params.paths import resolve
    from rosz.params.remote import ParamClient

    environment = Environment.read()
    node = remap.parse(context.argv).node_name(_TOOL, environment.namespace)
    with ExitStack() as stack:
        if lasting:
            session = stack.enter_context(
                open_context(environment, context.argv, lasting=True)
            ).session
        else:
            session = stack.enter_context(open_session(environment))
        yield ParamClient(session, environment.domain), lambda name: resolve(name, node)
