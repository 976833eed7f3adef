"""``rosz bridge``: programs that speak other protocols take part in the network."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from typing import Annotated, Any, NoReturn

from msgspec import Struct

from rosz.cli.console import print_lines, until_stopped
from rosz.cli.core import open_master, read_master_place
from rosz.cli.declare import App, Option, at_least
from rosz.errors import UsageError

app = App("Let programs that speak other protocols take part in the network.")

_LONG = 3600.0
_LAST_PORT = 65535

_Listen = Annotated[str, Option("--listen ADDRESS", "Address to listen at, instead of 127.0.0.1.")]
_PasswordFile = Annotated[
    str, Option("--password-file FILE", "File whose first line clients must know.")
]
_ReadOnly = Annotated[bool, Option("--read-only", "Let clients change nothing.")]
_Topics = Annotated[
    list[str] | None, Option("--topics PATTERN", "Topics that clients see; repeatable.")
]
_Services = Annotated[
    list[str] | None, Option("--services PATTERN", "Services that clients see; repeatable.")
]
_Params = Annotated[
    list[str] | None, Option("--params PATTERN", "Parameters that clients see; repeatable.")
]
_Certificate = Annotated[str, Option("--certificate FILE", "Certificate for TLS.")]
_Key = Annotated[str, Option("--key FILE", "Private key of the certificate.")]


@app.command("ros1")
def ros1_command(
    *,
    master: Annotated[
        str, Option("--master URI", "Join a roscore, such as http://robot:11311.")
    ] = "",
    namespace: Annotated[
        str, Option("--namespace NAME", "Namespace for all names of the roscore.")
    ] = "",
    topics: Annotated[
        list[str] | None,
        Option("--topics PATTERN", "Topics that cross, all by default; repeatable."),
    ] = None,
    services: Annotated[
        list[str] | None,
        Option("--services PATTERN", "Services that cross, all by default; repeatable."),
    ] = None,
    params: Annotated[
        list[str] | None,
        Option("--params PATTERN", "Parameters that cross, all by default; repeatable."),
    ] = None,
    port: Annotated[
        str, Option("-p --port PORT", "Without --master: port of the master, instead of 11311.")
    ] = "",
    address: Annotated[
        str, Option("--address ADDRESS", "Without --master: its address, instead of 127.0.0.1.")
    ] = "",
) -> None:
    """Join a roscore, or be the master of ROS 1's programs, until it is stopped."""
    place = read_master_place(port, address, wanted=not master)
    crossing = namespace or topics or services or params
    if place is not None and crossing:
        raise UsageError("--namespace, --topics, --services and --params need --master")
    if namespace and not namespace.startswith("/"):
        raise UsageError(f"--namespace is '{namespace}': expected a global name such as /robot1")
    from rosz.environment import Environment

    environment = Environment.read()
    with until_stopped() as ready, ExitStack() as stack:
        if place is not None:
            lines = open_master(environment, *place, stack)
        else:
            from rosz.bridges.ros1 import AttachedBridge, CrossingNames

            names = CrossingNames(tuple(topics or ()), tuple(services or ()), tuple(params or ()))
            stack.enter_context(
                AttachedBridge(master, environment, names=names, namespace=namespace)
            )
            lines = [f"joining the roscore at {master}"]
        _run(ready, lines)


class _WebsocketOptions(Struct, frozen=True, kw_only=True):
    """The options of ``rosz bridge websocket``."""

    port: Annotated[int, Option("-p --port PORT", "Port to listen at; 0 for any.")] = 9090
    listen: _Listen = "127.0.0.1"
    password_file: _PasswordFile = ""
    origin: Annotated[
        list[str] | None,
        Option("--origin ORIGIN", "Pages that may connect, such as http://robot; repeatable."),
    ] = None
    read_only: _ReadOnly = False
    topics: _Topics = None
    services: _Services = None
    params: _Params = None
    ros2: Annotated[
        bool, Option("--ros2", "Use ROS 2's spelling with clients that have not shown theirs.")
    ] = False
    certificate: _Certificate = ""
    key: _Key = ""


@app.command("websocket")
def websocket_command(options: _WebsocketOptions) -> None:
    """Serve the rosbridge protocol to web pages and other programs, until it is stopped."""
    from rosz.bridges.rosbridge import RosbridgeSettings, open_bridge
    from rosz.node import Node

    settings = RosbridgeSettings(**_settings(options), spelling="ros2" if options.ros2 else "ros1")
    with until_stopped() as ready, Node("rosbridge_websocket", anonymous=True, argv=()) as node:
        bridge, lines = open_bridge(node, settings)
        with closing(bridge):
            _run(ready, lines)


class _FoxgloveOptions(Struct, frozen=True, kw_only=True):
    """The options of ``rosz bridge foxglove``."""

    port: Annotated[int, Option("-p --port PORT", "Port to listen at; 0 for any.")] = 8765
    listen: _Listen = "127.0.0.1"
    password_file: _PasswordFile = ""
    origin: Annotated[
        list[str] | None,
        Option("--origin ORIGIN", "Pages that may connect, beside Foxglove's; repeatable."),
    ] = None
    read_only: _ReadOnly = False
    topics: _Topics = None
    services: _Services = None
    params: _Params = None
    certificate: _Certificate = ""
    key: _Key = ""


@app.command("foxglove")
def foxglove_command(options: _FoxgloveOptions) -> None:
    """Serve Foxglove, Lichtblick and other viewers, until it is stopped."""
    from rosz.bridges.foxglove import FoxgloveSettings, open_bridge
    from rosz.node import Node

    settings = FoxgloveSettings(**_settings(options))
    with until_stopped() as ready, Node("foxglove_bridge", anonymous=True, argv=()) as node:
        bridge, lines = open_bridge(node, settings)
        with closing(bridge):
            _run(ready, lines)


def _settings(options: _WebsocketOptions | _FoxgloveOptions) -> dict[str, Any]:
    """Return the settings that both bridges have."""
    at_least("--port", options.port, 0, "as a port", _LAST_PORT)
    return {
        "host": options.listen,
        "port": options.port,
        "password_file": options.password_file,
        "origins": tuple(options.origin or ()),
        "read_only": options.read_only,
        "topics": tuple(options.topics or ()),
        "services": tuple(options.services or ()),
        "params": tuple(options.params or ()),
        "certificate": options.certificate,
        "key": options.key,
    }


def _run(ready: Callable[[], None], lines: list[str]) -> NoReturn:
    """Print the first lines of a bridge, and wait until it is stopped."""
    ready()
    print_lines([*lines, "started the bridge; press Ctrl-C to end it"])
    while True:
        time.sleep(_LONG)
