"""The windows of ROS 1, rqt's and rviz, as pages: their names, and what they are started with.

A page server that runs on this machine shows the page; without one, the window serves the pages
itself until it ends. The packages in ``windows`` have a program for each.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from rosz.errors import RoszError, TransportError
from rosz.introspect.survey import Survey
from rosz.msgs.std_srvs.srv import Trigger
from rosz.web.opening import PAGE_SERVICE, Settings, open_page

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("WINDOWS", "main", "page_of")

_REMAP = re.compile(r"[^=\s]*:=")
_WAIT_SECONDS = 5.0
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

    def page(words: Sequence[str], resolve: Resolve) -> str:
        return _with_names(path, key, map(resolve, words))

    return page


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
    """Return the address of the page of a window, without its host, and what it cannot show.

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
    """Return the page of the first plugin of a perspective, and those of the others.

    Raises:
        UsageError: The file cannot be read.
        InvalidName: A name is not legal.
    """
    from rosz.web.perspective_file import read_perspective

    plugins = read_perspective(path)
    known = {one: _window_of(one) for one in plugins}
    pages = [WINDOWS[known[one]](plugins[one], resolve) for one in plugins if known[one]]
    left_out = [one for one in plugins if not known[one]]
    notes = [f"and at {page}" for page in pages[1:]]
    if left_out:
        notes.append(f"not shown: {', '.join(left_out)}")
    return pages[0] if pages else "/", notes


def _page_of_rviz(
    words: Sequence[str], options: dict[str, str], resolve: Resolve
) -> tuple[str, list[str]]:
    """Return the view in space that rviz is started with, and what it does not show.

    Raises:
        UsageError: The file cannot be read.
    """
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
    """Show the page until the node is shut down.

    Raises:
        RoszError: The page cannot be shown.
    """
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
                server, lines = open_page(node, Settings())
            except TransportError:  # perhaps another window began just now
                address = _find_page(node, _WAIT_SECONDS)
                if not address:
                    server, lines = open_page(node, Settings(port=0))
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
    """Return the address of a page server of this machine; empty if there is none.

    Args:
        node: The node that looks for it.
        seconds: Time to wait for one.
    """

    def servers() -> list[str]:
        view = node.context.graph.refresh()
        processes = {(one.zid, one.node_id): one for one in view.processes()}
        survey = Survey(node.context.domain, view, processes)
        return [
            token.name
            for service, types in view.services().items()
            if service.endswith(f"/{PAGE_SERVICE}") and "std_srvs/srv/Trigger" in types
            for token in view.servers(service)
            if survey.host(token) == node.process.host
        ]

    import time

    deadline = time.monotonic() + seconds
    while not (found := servers()) and time.monotonic() < deadline:
        time.sleep(0.2)
    for service in found:
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
