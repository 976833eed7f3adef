"""The windows of ROS 1, rqt's and rviz, as pages: their names, and what they are started with.

A page server that runs on this machine shows the page; without one, the window serves the pages
itself until it ends. The packages in ``windows`` have a program for each.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Callable, Sequence
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
_VALUED = frozenset({"-d", "--display-config", "-f", "--fixed-frame", "-p", "--perspective"})
_VALUED |= {"--perspective-file", "-s", "--standalone", "-t", "--splash-screen", "-l"}


def _plain(path: str) -> Callable[[Sequence[str]], str]:
    return lambda _words: path


def _topics(path: str, key: str) -> Callable[[Sequence[str]], str]:
    """Return a function that makes the address of a page from the topics that are given."""

    def page(words: Sequence[str]) -> str:
        names = [word if word.startswith("/") else f"/{word}" for word in words]
        return f"{path}?{urlencode({key: ','.join(names)}, safe='/,:[]')}" if names else path

    return page


WINDOWS: dict[str, Callable[[Sequence[str]], str]] = {
    "rqt": _plain("/"),
    "rqt_bag": _plain("/bags"),
    "rqt_console": _plain("/console"),
    "rqt_graph": _plain("/graph"),
    "rqt_gui": _plain("/"),
    "rqt_image_view": _topics("/images", "topics"),
    "rqt_logger_level": _plain("/console"),
    "rqt_plot": _topics("/plot", "fields"),
    "rqt_publisher": _plain("/topics"),
    "rqt_reconfigure": _topics("/reconfigure", "server"),
    "rqt_robot_steering": _plain("/drive"),
    "rqt_service_caller": _plain("/services"),
    "rqt_tf_tree": _plain("/3d?show=grid,tf"),
    "rqt_topic": _plain("/topics"),
    "rviz": _plain("/3d"),
}
"""The names of windows, with the function that returns the page for their arguments."""


def page_of(name: str, arguments: Sequence[str]) -> tuple[str, list[str]]:
    """Return the address of the page of a window, without its host, and what it cannot show.

    Args:
        name: Name of the window.
        arguments: Its command line, without remappings.

    Raises:
        UsageError: The file that it names cannot be read.
    """
    words: list[str] = []
    options: dict[str, str] = {}
    rest = iter(arguments)
    for word in rest:
        option, equals, value = word.partition("=")
        if option in _VALUED:
            options[option] = value if equals else next(rest, "")
        elif not word.startswith("-"):
            words.append(word)
    plugin = options.get("-s", options.get("--standalone", ""))
    plugin = re.split(r"[/.]", plugin)[0]
    if name in {"rqt", "rqt_gui"} and plugin in WINDOWS:
        name = plugin
    if name != "rviz":
        return WINDOWS[name](words), []
    file = options.get("-d", options.get("--display-config", words[0] if words else ""))
    fixed = options.get("-f", options.get("--fixed-frame", ""))
    if not file:
        query = urlencode({"frame": fixed}, safe="/")
        return f"/3d?{query}" if fixed else "/3d", []
    import msgspec

    from rosz.web.rviz_file import read_rviz
    from rosz.web.scene import format_setup

    setup, left_out = read_rviz(Path(file))
    if fixed:
        setup = msgspec.structs.replace(setup, frame=fixed)
    return format_setup(setup), [f"not shown: {', '.join(left_out)}"] if left_out else []


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

    path, notes = page_of(name, [word for word in arguments if not _REMAP.match(word)])
    launched = any(word.startswith("__name:=") for word in arguments)
    with Node(name, anonymous=True) as node:
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
