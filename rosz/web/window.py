"""The windows of ROS 1, rqt's and rviz, as pages: their names and arguments.

A page server that runs on this machine shows the page; without one, the window serves the pages
itself until it ends. The packages in ``windows`` have a program for each.
"""

from __future__ import annotations

import ast
import importlib.util
import json
import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from rosz.errors import RoszError, TransportError, UsageError
from rosz.introspect import Survey
from rosz.msgs.std_srvs.srv import Trigger
from rosz.web.opening import PAGE_SERVICE, PageSettings, open_page

if TYPE_CHECKING:
    from rosz.node import Node

_REMAP = re.compile(r"[^=\s]*:=")
_WAIT_SECONDS = 5.0
_TOPIC_KEYS = ("topic", "topics")
"""Keys under which plugins such as rqt_image_view and rqt_plot keep their topics."""
_VALUED_BY_RVIZ = {"-d", "--display-config", "-f", "--fixed-frame", "-s", "--splash-screen"}
_VALUED_BY_RVIZ |= {"--help-file", "--opengl"}
_VALUED_BY_RQT = {"-b", "--qt-binding", "-p", "--perspective", "--perspective-file"}
_VALUED_BY_RQT |= {"-s", "--standalone"}

Resolve = Callable[[str], str]
"""Function that returns the full name of a topic, after remapping."""
Page = Callable[[Sequence[str], Resolve], str]
"""Function that returns the address of a page for the words of a command line."""


def _plain(path: str) -> Page:
    return lambda _words, _resolve: path


def _topics(path: str, key: str) -> Page:
    """Return a function that makes the address of a page from the topics that are given."""
    return lambda words, resolve: _with_names(path, key, map(resolve, words))


def _with_names(path: str, key: str, names: Iterable[str]) -> str:
    text = ",".join(dict.fromkeys(names))
    return f"{path}?{urlencode({key: text}, safe='/,:[]')}" if text else path


def _namespace(resolve: Resolve) -> str:
    """Return the namespace that names are resolved in, with a slash at its end."""
    return resolve("rosz_page").removesuffix("rosz_page")


def _fields(words: Sequence[str], resolve: Resolve) -> str:
    """Return the page that plots fields; more than a name of a topic is not remapped."""
    here = _namespace(resolve)
    return _with_names(
        "/plot", "fields", (word if word.startswith("/") else here + word for word in words)
    )


def _images(words: Sequence[str], resolve: Resolve) -> str:
    """Return the page of images: those that are named, or what ``image:=`` names."""
    names, image = list(map(resolve, words)), resolve("image")
    if image != f"{_namespace(resolve)}image":
        names.append(image)
    return _with_names("/images", "topics", names)


WINDOWS: dict[str, Page] = {
    "image_view": lambda _words, resolve: _images(["image"], resolve),
    "rqt": _plain("/"),
    "rqt_action": _plain("/actions"),
    "rqt_bag": _plain("/bags"),
    "rqt_console": _plain("/console"),
    "rqt_graph": _plain("/graph"),
    "rqt_gui": _plain("/"),
    "rqt_image_view": _images,
    "rqt_launch": _plain("/"),
    "rqt_logger_level": _plain("/console"),
    "rqt_nav_view": _plain("/3d?show=grid,tf,/map&view=top"),
    "rqt_plot": _fields,
    "rqt_publisher": _plain("/topics"),
    "rqt_reconfigure": _topics("/reconfigure", "server"),
    "rqt_robot_monitor": _plain("/topics?topic=/diagnostics_agg"),
    "rqt_robot_steering": _topics("/drive", "topic"),
    "rqt_runtime_monitor": _plain("/topics?topic=/diagnostics"),
    "rqt_service_caller": _plain("/services"),
    "rqt_tf_tree": _plain("/3d?show=grid,tf"),
    "rqt_top": _plain("/"),
    "rqt_topic": _plain("/topics"),
    "rviz": _plain("/3d"),
}
"""The names of windows, with the function that returns the page for their arguments."""


def page_of(name: str, arguments: Sequence[str], resolve: Resolve) -> tuple[str, list[str]]:
    """Return the address of the page of a window, without its host, and the parts not shown.

    Args:
        name: Name of the window.
        arguments: Its command line, without remappings.
        resolve: Function that returns the full name of a topic, after remapping.

    Raises:
        UsageError: The file that it names cannot be read.
        InvalidName: A name is not legal.
    """
    words: list[str] = []
    options: dict[str, str] = {}
    valued = _VALUED_BY_RVIZ if name == "rviz" else _VALUED_BY_RQT
    rest = iter(arguments)
    for word in rest:
        option, equals, value = word.partition("=")
        if option in valued:
            options[option] = value if equals else next(rest, "")
        elif not word.startswith("-"):
            words.append(word)
    if name == "rviz":
        return _page_of_rviz(words, options, resolve)
    perspective = options.get("--perspective-file", "")
    if perspective:
        return _page_of_perspective(Path(perspective), resolve)
    plugin = options.get("-s", options.get("--standalone", ""))
    shown = _window_of(plugin) if name in {"rqt", "rqt_gui"} else name
    notes = [f"not shown: {plugin}"] if plugin and not shown else []
    return WINDOWS[shown or name](words, resolve), notes


def _window_of(plugin: str) -> str:
    """Return the window that a plugin of rqt is; empty if no page takes its place."""
    name = re.split(r"[/.]", plugin)[0].replace("rqt_rviz", "rviz")
    return name if name in WINDOWS else ""


def _page_of_perspective(path: Path, resolve: Resolve) -> tuple[str, list[str]]:
    """Return the page of the first plugin of a perspective, and those of the others."""
    plugins = _read_perspective(path)
    windows = {plugin: _window_of(plugin) for plugin in plugins}
    pages = [
        WINDOWS[windows[plugin]](plugins[plugin], resolve) for plugin in plugins if windows[plugin]
    ]
    left_out = [plugin for plugin in plugins if not windows[plugin]]
    notes = [f"and at {page}" for page in pages[1:]]
    if left_out:
        notes.append(f"not shown: {', '.join(left_out)}")
    return pages[0] if pages else "/", notes


def _read_perspective(path: Path) -> dict[str, list[str]]:
    """Return the plugins that a perspective shows, such as ``rqt_plot/Plot``, with their topics."""
    try:
        content = json.loads(path.read_text())
        manager = content["groups"]["pluginmanager"]
        running = _literal(manager["keys"]["running-plugins"])
        return {
            str(plugin): [
                topic for number in numbers for topic in _topics_in(manager, str(plugin), number)
            ]
            for plugin, numbers in running.items()
        }
    except OSError as error:
        raise UsageError(f"cannot read '{path}': {error}") from error
    except (ValueError, SyntaxError, LookupError, TypeError, AttributeError) as error:
        raise UsageError(
            f"'{path}' is not a perspective of rqt: expected JSON with 'running-plugins'"
        ) from error


def _literal(entry: dict[str, Any]) -> Any:
    """Return the value of an entry, which is written as Python writes it."""
    return ast.literal_eval(entry["repr"])


def _topics_in(manager: dict[str, Any], plugin: str, number: int) -> list[str]:
    """Return the topics that an instance of a plugin shows; none for an unknown plugin."""
    name = f"plugin__{plugin.replace('/', '__')}__{number}"
    keys = manager.get("groups", {}).get(name, {}).get("groups", {}).get("plugin", {})
    names: list[str] = []
    for key in _TOPIC_KEYS:
        entry = keys.get("keys", {}).get(key)
        if entry is not None:
            value = _literal(entry)
            names += [value] if isinstance(value, str) else value
    return [text for text in map(str, names) if text.strip("/ ")]


def _page_of_rviz(
    words: Sequence[str], options: dict[str, str], resolve: Resolve
) -> tuple[str, list[str]]:
    """Return the view in space that rviz is started with, and the parts not shown."""
    file = options.get("-d", options.get("--display-config", words[0] if words else ""))
    fixed = options.get("-f", options.get("--fixed-frame", ""))
    if not file:
        query = urlencode({"frame": fixed}, safe="/")
        return f"/3d?{query}" if fixed else "/3d", []
    import msgspec

    from rosz.web.rviz_file import read_rviz
    from rosz.web.scene import format_setup

    setup, left_out = read_rviz(Path(file), resolve)
    if fixed:
        setup = msgspec.structs.replace(setup, frame=fixed)
    return format_setup(setup), [f"not shown: {'; '.join(left_out)}"] if left_out else []


def main(name: str) -> None:
    """Open the page of a window, and stay as long as the window would.

    Args:
        name: Name of the window.
    """
    try:
        _show(name, sys.argv[1:])
    except RoszError as error:
        sys.exit(f"{name}: {error}")


def _show(name: str, arguments: Sequence[str]) -> None:
    """Show the page until the node is shut down."""
    if importlib.util.find_spec("nicegui") is None or importlib.util.find_spec("numpy") is None:
        raise TransportError("the page needs libraries: pip install 'rosz[web]'")
    from rosz.node import Node

    launched = any(word.startswith("__name:=") for word in arguments)
    with Node(name, anonymous=True) as node:
        words = [word for word in arguments if not _REMAP.match(word)]
        if name == "rqt_robot_steering":
            words = [str(node.params.get("~default_topic", "/cmd_vel"))]
        path, notes = page_of(name, words, node.resolve)
        address, server = _find_page(node), None
        if not address:
            try:
                server, lines = open_page(node, PageSettings())
            except TransportError:  # perhaps another window began just now
                address = _find_page(node, _WAIT_SECONDS)
                if not address:
                    server, lines = open_page(node, PageSettings(port=0))
            if server is not None:
                address, notes = lines[0], [*notes, *lines[1:]]
        _open(f"{address.rstrip('/')}{path}", notes)
        if server is not None or launched:
            sys.stdout.write("press Ctrl-C to end it\n")
            sys.stdout.flush()
            node.spin()
        if server is not None:
            server.close()


def _find_page(node: Node, seconds: float = 0.0) -> str:
    """Return the address of a page server of this machine; empty if none comes in time."""

    def servers() -> list[str]:
        view = node.context.graph.refresh()
        processes = {(token.zid, token.node_id): token for token in view.processes()}
        survey = Survey(node.context.domain, view, processes)
        return [
            token.name
            for service, types in view.services().items()
            if service.endswith(f"/{PAGE_SERVICE}") and "std_srvs/srv/Trigger" in types
            for token in view.servers(service)
            if survey.host(token) == node.process.host
        ]

    deadline = time.monotonic() + seconds
    while not (pages := servers()) and time.monotonic() < deadline:
        time.sleep(0.2)
    for service in pages:
        with node.client(service, Trigger, timeout=_WAIT_SECONDS) as client:
            try:
                return str(client.call(Trigger.Request()).message)
            except RoszError as error:
                node.log.debug("'%s' does not reply: %s", service, error)
    return ""


def _open(address: str, notes: Sequence[str]) -> None:
    """Print the address of a page, and open it if this machine has a screen."""
    sys.stdout.write(f"the page is at {address}\n")
    for note in notes:
        sys.stdout.write(f"{note}\n")
    sys.stdout.flush()
    screen = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    if screen or sys.platform == "darwin":
        import webbrowser

        webbrowser.open(address)
