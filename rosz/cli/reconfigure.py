"""``rosz reconfigure``: the commands of dynparam, and ``describe`` and ``watch``."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from msgspec import Struct

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
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
from rosz.cli.declare import Argument, Json, Option, at_least, seconds, values_last
from rosz.errors import NotFoundError, WaitTimeout, near_miss

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.reconfigure import Client, Config, Description, Group, Setting

app = new_group("Read and change settings of nodes while they run (dynamic_reconfigure).")

_TOOL = "dynparam"
_TIMEOUT = 10.0
_QUIET_SECONDS = 1.0
"""Time to wait for a node before saying so."""
_FOR_EVER = 1e9

_Setting = Annotated[str, Argument("SETTING", "All settings if omitted.")]


class SettingsNode(Struct, frozen=True, kw_only=True):
    """The node whose settings a command reads or changes, and how long it waits for that node."""

    node: Annotated[str, Argument("NODE", source=suggest.nodes)]
    timeout: Annotated[
        float | None,
        Option(
            "-t --timeout SECONDS",
            "Time limit to wait for the node and for its reply. Without it the node must be"
            " running, and reply within 10 seconds.",
        ),
    ] = None
    wait: Annotated[bool, Option("--wait", "Wait until the node runs.")] = False


@app.command("list")
def list_command(call: Call, *, json: Json = False) -> None:
    """List the nodes that have settings."""
    from rosz.reconfigure import find_servers

    servers = find_servers(call.survey().view)
    print_result(servers, servers, as_json=json)


@app.command("get")
def get_command(
    call: Call, target: SettingsNode, setting: _Setting = "", *, json: Json = False
) -> None:
    """Print all settings of a node as dynparam does, or the value of one setting."""
    from rosz.params.yaml import format_get
    from rosz.reconfigure.messages import decode_description, in_groups, pack_description

    with _client(call, target) as client:
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
        tree = decode_description(pack_description(description))
        print_lines([repr(in_groups(config, tree))])


@app.command("set", arrange=values_last("-t", "--timeout"))
def set_command(
    call: Call,
    target: SettingsNode,
    setting: Annotated[str, Argument("SETTING|YAML", "One setting, or a dictionary of several.")],
    value: Annotated[str | None, Argument("VALUE", "The value of one setting.")] = None,
    *,
    json: Json = False,
) -> None:
    """Change settings of a node; a choice can be given by its name."""
    from rosz.reconfigure import load

    with _client(call, target) as client:
        changes = load(setting, "<value>") if value is None else {setting: value}
        _change(client, changes, as_json=json)


@app.command("set_from_parameters")
def set_from_parameters_command(call: Call, target: SettingsNode, *, json: Json = False) -> None:
    """Change settings of a node to the private parameters of this command, such as _gain:=2."""
    with _client(call, target) as client:
        changes: dict[str, Any] = client.node.params.get("~", {})
        if not changes:
            raise NotFoundError(
                f"no parameters are set under '{client.node.name}'; give some as _name:=value, or"
                " as <param> of the node in the launch file"
            )
        _change(client, changes, as_json=json)


@app.command("dump")
def dump_command(
    call: Call,
    target: SettingsNode,
    file: Annotated[str, Argument("FILE", "'-' is standard output.", suggest.files)],
) -> None:
    """Write all settings of a node to a YAML file."""
    from rosz.reconfigure import dump

    with _client(call, target) as client:
        text = dump(client.config())
    if file == "-":
        sys.stdout.write(text)
    else:
        write_file(file, text.encode())


@app.command("load")
def load_command(
    call: Call,
    target: SettingsNode,
    file: Annotated[str, Argument("FILE", "'-' is standard input.", suggest.files)],
    *,
    json: Json = False,
) -> None:
    """Change settings of a node to those in a YAML file, also one written by ROS 1's dynparam."""
    from rosz.reconfigure import load

    text = sys.stdin.read() if file == "-" else Path(file).read_text(encoding="utf-8")
    changes = load(text, "<stdin>" if file == "-" else file)
    with _client(call, target) as client:
        _change(client, changes, as_json=json)


@app.command("describe")
def describe_command(
    call: Call, target: SettingsNode, setting: _Setting = "", *, json: Json = False
) -> None:
    """Print the types, values, bounds, choices and groups of the settings of a node."""
    with _client(call, target) as client:
        description, config = client.description(), client.config()
    _print_description(description, config, setting, as_json=json)


@app.command("watch")
def watch_command(
    call: Call,
    *,
    count: Annotated[int | None, Option("-n COUNT", "Stop after this number of changes.")] = None,
    target: SettingsNode,
    json: Json = False,
) -> None:
    """Print changes of the settings of a node as they happen."""
    at_least("-n", count, 1, "changes")
    from queue import SimpleQueue

    from rosz.params.yaml import inline

    configs: SimpleQueue[Config] = SimpleQueue()
    with until_stopped() as ready, _client(call, target, lasting=True) as client:
        ready()
        before = _flatten(client.config())
        client.config_callback = configs.put
        print_error(f"watching [{client.name}]; press Ctrl-C to end")
        left = count
        while left is None or left > 0:
            now = _flatten(configs.get())
            changed = [name for name in now if now[name] != before.get(name)]
            for name in changed[:left]:
                old, new = before.get(name), now[name]
                if json:
                    print_json_line({"name": name, "old": old, "new": new})
                else:
                    print_lines([f"~ {name}: {inline(old)} -> {inline(new)}"])
            left = None if left is None else left - len(changed)
            before = now


@contextmanager
def _client(call: Call, target: SettingsNode, *, lasting: bool = False) -> Iterator[Client]:
    timeout, wait = target.timeout, target.wait
    if timeout is not None:
        seconds("--timeout", timeout)
    from rosz.node import Node
    from rosz.reconfigure import Client

    full = call.resolve(target.node, _TOOL)
    with (
        call.context(lasting=lasting or wait) as ros,
        Node(_TOOL, anonymous=True, context=ros) as node,
        Client(node, full, timeout=timeout or _TIMEOUT) as client,
    ):
        if wait or timeout is not None:
            _wait_for(client, _FOR_EVER if wait else client.timeout)
        else:
            ros.graph.find(partial(_check_served, client.name))
        yield client


def _check_served(name: str, view: View) -> None:
    """Check that a node has settings.

    Raises:
        NotFoundError: It has none, or does not exist.
    """
    from rosz.reconfigure import find_servers

    servers = find_servers(view)
    if name not in servers:
        hint = near_miss(name, servers) or "; 'rosz reconfigure list' lists them"
        raise NotFoundError(f"no node has settings under '{name}'{hint}")


def _wait_for(client: Client, seconds: float) -> None:
    try:
        client.wait(min(seconds, _QUIET_SECONDS))
    except WaitTimeout:
        if seconds <= _QUIET_SECONDS:
            raise
        print_error(f"Waiting for service {client.name}/set_parameters...")
        client.wait(seconds - _QUIET_SECONDS)


def _change(client: Client, changes: Mapping[str, Any], *, as_json: bool) -> None:
    """Change settings, and warn of those that the node has set to another value."""
    wanted = client.description().convert(changes)
    config = client.update(changes)
    for name, value in wanted.items():
        if config[name] != value:
            warn(f"{name} is {config[name]!r} and not {value!r}: the node decided so")
    if as_json:
        print_json(config)


def _print_description(
    description: Description, config: Config, only: str, *, as_json: bool
) -> None:
    if only:
        setting = description.setting(only)
        lines = _describe(setting, config, "")
        print_result(lines, _setting_row(setting, config), as_json=as_json)
    elif as_json:
        rows = [_setting_row(setting, config) for setting in description.settings.values()]
        print_json({"settings": rows, "groups": _group_rows(description)})
    else:
        print_lines(_describe_group(description.root, config, config["groups"], ""))


def _describe_group(group: Group, config: Config, tree: Config, indent: str) -> Iterator[str]:
    for setting in group.settings:
        yield from _describe(setting, config, indent)
    for inner in group.groups:
        state = tree["groups"][inner.name]
        notes = ", ".join(filter(None, (inner.type, "" if state["state"] else "not shown")))
        yield f"{indent}[{inner.name}]{' ' + notes if notes else ''}"
        yield from _describe_group(inner, config, state, indent + "  ")


def _describe(setting: Setting, config: Config, indent: str) -> Iterator[str]:
    yield f"{indent}{setting.name} ({setting.kind}) = {config[setting.name]!r}"
    if setting.description:
        yield f"{indent}    {setting.description}"
    bounds = ""
    if setting.kind in {"int", "double"}:
        bounds = f", min {setting.min!r}, max {setting.max!r}"
    yield f"{indent}    default {setting.default!r}{bounds}, level {setting.level}"
    choices = setting.choices
    width = max((len(choice.name) for choice in choices), default=0)
    for choice in choices:
        yield f"{indent}    {choice.name:<{width}}  {choice.value!r}  {choice.description}".rstrip()


def _setting_row(setting: Setting, config: Config) -> dict[str, Any]:
    return {
        "name": setting.name,
        "type": setting.kind,
        "value": config[setting.name],
        "default": setting.default,
        "min": setting.min,
        "max": setting.max,
        "level": setting.level,
        "description": setting.description,
        "choices": setting.choices,
    }


def _group_rows(description: Description) -> list[dict[str, Any]]:
    return [
        {
            "name": group.name,
            "id": group.id,
            "parent": parent,
            "type": group.type,
            "settings": [setting.name for setting in group.settings],
        }
        for group, parent in description.groups
    ]


def _flatten(config: Config) -> dict[str, Any]:
    """Return the values by name, and the states of groups by ``groups/<name>``."""
    values = {name: value for name, value in config.items() if name != "groups"}
    return values | dict(_states(config["groups"], "groups"))


def _states(tree: Config, place: str) -> Iterator[tuple[str, bool]]:
    for name, inner in tree["groups"].items():
        yield f"{place}/{name}", inner["state"]
        yield from _states(inner, f"{place}/{name}")
