"""``rosz reconfigure``: what dynparam does, and describing and watching."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli.bounds import at_least, seconds
from rosz.cli.declare import Argument, Context, Option, values_last
from rosz.cli.group import (
    call_of,
    new_group,
    print_json,
    print_lines,
    until_stopped,
    warn,
    write_file,
)
from rosz.cli.reconfigure_show import flatten, show_change, show_description
from rosz.errors import NotFoundError, UsageError, WaitTimeout, near_miss

if TYPE_CHECKING:
    from rosz.reconfigure import Client, Config

__all__ = ("app",)

app = new_group("Read and change settings of nodes while they run (dynamic_reconfigure).")

_TOOL = "dynparam"
_ANSWER_SECONDS = 10.0
_SILENT_SECONDS = 1.0
_FOR_EVER = 1e9

_Json = Annotated[bool, Option("--json", help="As JSON.")]
_Server = Annotated[str, Argument(metavar="NODE")]
_File = Annotated[str, Argument(metavar="FILE", help="- for the standard streams.")]
_Timeout = Annotated[
    float | None,
    Option(
        "-t",
        "--timeout",
        metavar="SECONDS",
        help="Wait so long for the node and its answer; else it must be there, and answer in 10.",
    ),
]
_Wait = Annotated[bool, Option("--wait", help="Wait until the node is there.")]


@app.command("list")
def list_command(context: Context, *, json: _Json = False) -> None:
    """List what can be configured, mostly nodes."""
    from rosz.reconfigure import find_servers

    found = find_servers(call_of(context).survey().view)
    if json:
        print_json(found)
    else:
        print_lines(found)


@app.command("get")
def get_command(
    context: Context,
    node: _Server,
    setting: Annotated[str, Argument(metavar="[SETTING]")] = "",
    *,
    timeout: _Timeout = None,
    wait: _Wait = False,
    json: _Json = False,
) -> None:
    """Print all settings of a node, as dynparam does, or the value of one."""
    from rosz.params.yaml import format_get
    from rosz.reconfigure.messages import pack_description
    from rosz.ros1.dynamic_reconfigure.encoding import decode_description, in_groups

    with _client(context, node, timeout, wait=wait) as client:
        description, config = client.description(), client.config()
    if setting:
        value = config[description.setting(setting).name]
        if json:
            print_json(value)
        else:
            sys.stdout.write(format_get(value))
    elif json:
        print_json(config)
    else:
        print_lines([repr(in_groups(config, decode_description(pack_description(description))))])


@app.command("set", arrange=values_last(frozenset({"-t", "--timeout"})))
def set_command(
    context: Context,
    node: _Server,
    words: Annotated[
        list[str],
        Argument(metavar="SETTING VALUE | YAML", help="One setting, or a dictionary of several."),
    ],
    *,
    timeout: _Timeout = None,
    wait: _Wait = False,
    json: _Json = False,
) -> None:
    """Change settings of a node; a choice may be given by its name."""
    from rosz.reconfigure import load

    if len(words) > 2:  # noqa: PLR2004
        raise UsageError(
            f"{len(words)} words behind the node; expected a setting and its value, or a dictionary"
        )
    with _client(context, node, timeout, wait=wait) as client:
        changes: Mapping[str, Any] = (
            {words[0]: words[1]} if len(words) > 1 else load(words[0], "<value>")
        )
        _change(client, changes, as_json=json)


@app.command("set_from_parameters")
def set_from_parameters_command(
    context: Context,
    node: _Server,
    *,
    timeout: _Timeout = None,
    wait: _Wait = False,
    json: _Json = False,
) -> None:
    """Change settings of a node to the private parameters of this command (_gain:=2)."""
    with _client(context, node, timeout, wait=wait) as client:
        params = client.node.params
        changes: dict[str, Any] = params.get("~", {})
        if not changes:
            raise NotFoundError(
                f"no parameters are set under '{client.node.name}'; give some as _name:=value, or"
                " as <param> of the node in the launch file"
            )
        _change(client, changes, as_json=json)


@app.command("dump")
def dump_command(
    context: Context,
    node: _Server,
    file: _File,
    *,
    timeout: _Timeout = None,
    wait: _Wait = False,
) -> None:
    """Write all settings of a node to a YAML file."""
    from rosz.reconfigure import dump

    with _client(context, node, timeout, wait=wait) as client:
        text = dump(client.config())
    if file == "-":
        sys.stdout.write(text)
    else:
        write_file(file, text.encode())


@app.command("load")
def load_command(
    context: Context,
    node: _Server,
    file: _File,
    *,
    timeout: _Timeout = None,
    wait: _Wait = False,
    json: _Json = False,
) -> None:
    """Change settings of a node to those of a file, also one of ROS 1's dynparam."""
    from pathlib import Path

    from rosz.reconfigure import load

    text = sys.stdin.read() if file == "-" else Path(file).read_text(encoding="utf-8")
    changes = load(text, "<stdin>" if file == "-" else file)
    with _client(context, node, timeout, wait=wait) as client:
        _change(client, changes, as_json=json)


@app.command("describe")
def describe_command(
    context: Context,
    node: _Server,
    setting: Annotated[str, Argument(metavar="[SETTING]")] = "",
    *,
    timeout: _Timeout = None,
    wait: _Wait = False,
    json: _Json = False,
) -> None:
    """Tell what there is to set: types, values, bounds, choices, groups."""
    with _client(context, node, timeout, wait=wait) as client:
        description, config = client.description(), client.config()
    show_description(description, config, setting, as_json=json)


@app.command("watch")
def watch_command(
    context: Context,
    node: _Server,
    *,
    count: Annotated[
        int | None, Option("-n", metavar="COUNT", help="End after so many changes.")
    ] = None,
    timeout: _Timeout = None,
    wait: _Wait = False,
    json: _Json = False,
) -> None:
    """Print changes of a node's settings as they come."""
    if count is not None:
        at_least("-n", count, 1, "changes")
    from queue import SimpleQueue

    configs: SimpleQueue[Config] = SimpleQueue()
    with (
        until_stopped() as ready,
        _client(context, node, timeout, wait=wait, lasting=True) as client,
    ):
        ready()
        before = flatten(client.config())
        client.config_callback = configs.put
        sys.stderr.write(f"watching [{client.name}]; press Ctrl-C to end\n")
        sys.stderr.flush()
        left = count
        while left is None or left > 0:
            now = flatten(configs.get())
            changed = [name for name in now if now[name] != before.get(name)]
            for name in changed[:left]:
                show_change(name, before.get(name), now[name], as_json=json)
            left = None if left is None else left - len(changed)
            before = now


@contextmanager
def _client(
    context: Context,
    name: str,
    timeout: float | None,
    *,
    wait: bool,
    lasting: bool = False,
) -> Iterator[Client]:
    """Give a client of a server that is there.

    Raises:
        NotFoundError: It is not.
        WaitTimeout: It did not come in time.
    """
    if timeout is not None:
        seconds("--timeout", timeout)
    from rosz.node import Node
    from rosz.reconfigure import Client, find_servers

    call = call_of(context)
    full = call.resolve(name, _TOOL)
    with (
        call.context(lasting=lasting or wait) as ros,
        Node(_TOOL, anonymous=True, context=ros) as node,
        Client(node, full, timeout=timeout or _ANSWER_SECONDS) as client,
    ):
        if wait or timeout is not None:
            _wait_for(client, _FOR_EVER if wait else timeout or _ANSWER_SECONDS)
        else:
            known = find_servers(ros.graph.refresh())
            if client.name not in known:
                hint = near_miss(client.name, known) or "; 'rosz reconfigure list' lists them"
                raise NotFoundError(f"no node has settings under '{client.name}'{hint}")
        yield client


def _wait_for(client: Client, seconds: float) -> None:
    try:
        client.wait(min(seconds, _SILENT_SECONDS))
    except WaitTimeout:
        if seconds <= _SILENT_SECONDS:
            raise
        sys.stderr.write(f"Waiting for service {client.name}/set_parameters...\n")
        sys.stderr.flush()
        client.wait(seconds - _SILENT_SECONDS)


def _change(client: Client, changes: Mapping[str, Any], *, as_json: bool) -> None:
    """Change settings, and tell what the node made of them where that is something else."""
    wanted = client.description().convert(changes)
    config = client.update(changes)
    for name, value in wanted.items():
        if config[name] != value:
            warn(f"{name} is {config[name]!r} and not {value!r}: the node decided so")
    if as_json:
        print_json(config)
