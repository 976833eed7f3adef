"""The programs for web pages: those of ROS 1's rosbridge_suite, and tf2_web_republisher."""

from __future__ import annotations

from typing import Any

from rosz.access import AccessPolicy
from rosz.bridges.rosbridge import RosApi, RosbridgeSettings, open_bridge
from rosz.errors import UsageError
from rosz.node import Node
from rosz.transforms import Republisher

_LOOK_SECONDS = 5.0
_EVERYWHERE = ("", "0.0.0.0")  # noqa: S104  # what rosbridge_suite's parameter may be


def serve_websocket() -> None:
    """Serve the rosbridge protocol as the parameters of the node say, until the node ends.

    The parameters have the names of rosbridge_suite: ``~port``, ``~address``, ``~certfile``,
    ``~keyfile``, ``~authenticate``, ``~max_message_size``, ``~websocket_null_origin``,
    ``~topics_glob``, ``~services_glob``, ``~params_glob``. Those of its buffers and threads are
    ignored. ``~password_file`` names a file whose first line clients must know; without one, a
    random password is printed if ``~authenticate`` is true, or if the address is not one of this
    machine alone.

    Raises:
        RoszError: A parameter is not valid, or the port is in use.
    """
    with Node("rosbridge_websocket") as node:
        address = str(_get(node, "address", "127.0.0.1"))
        certificate = str(_get(node, "certfile", ""))
        settings = RosbridgeSettings(
            host="0.0.0.0" if address in _EVERYWHERE else address,  # noqa: S104  # as asked
            port=_port(_get(node, "port", 9090)),
            password_file=str(_get(node, "password_file", "")),
            authenticate=bool(_get(node, "authenticate", False)),
            fragment_size=_size(_get(node, "max_message_size", "None")),
            origins=("null",) if _get(node, "websocket_null_origin", True) else (),
            topics=_patterns(node, "topics_glob"),
            services=_patterns(node, "services_glob"),
            params=_patterns(node, "params_glob"),
            certificate=certificate,
            key=str(_get(node, "keyfile", "")) if certificate else "",
        )
        bridge, lines = open_bridge(node, settings)
        with bridge:
            for line in lines:
                node.log.info("%s", line)
            node.spin()


def serve_rosapi() -> None:
    """Serve the services of rosapi below ``/rosapi``, until the node ends."""
    with Node("rosapi") as node:
        policy = AccessPolicy(
            topics=_patterns(node, "topics_glob"),
            services=_patterns(node, "services_glob"),
            params=_patterns(node, "params_glob"),
        )
        RosApi(node).serve(policy, "ros1")
        node.spin()


def serve_transforms() -> None:
    """Serve transforms to web pages while no other node does so, until the node ends."""
    with Node("tf2_web_republisher") as node:

        def look(_event: Any) -> None:
            if not Republisher.is_served(node):
                timer.close()
                Republisher(node)

        timer = node.timer(_LOOK_SECONDS, look)
        look(None)
        node.spin()


def _get(node: Node, name: str, default: Any) -> Any:
    return node.params.get(f"~{name}", default)


def _port(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise UsageError(f"parameter '~port' is {value!r}: expected a number such as 9090")
    return value


def _size(value: Any) -> int | None:
    if value in (None, "None", ""):
        return None
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise UsageError(
            f"parameter '~max_message_size' is {value!r}: expected a number of characters or 'None'"
        )
    return value


def _patterns(node: Node, name: str) -> tuple[str, ...]:
    """Return the patterns in a parameter such as ``[/odom, /camera/*]``; none means all."""
    value = _get(node, name, "")
    parts = value if isinstance(value, list) else str(value).strip().strip("[]").split(",")
    patterns = (str(part).strip().strip("'\"") for part in parts)
    return tuple(filter(None, patterns))
