"""foxglove_bridge: the program of ROS's package of that name."""

from __future__ import annotations

import re
from typing import Any, TypeVar

from rosz.bridges.foxglove import (
    CAPABILITIES,
    PORT,
    SHOWN,
    FoxgloveLimits,
    FoxgloveSettings,
    Offer,
    open_bridge,
)
from rosz.errors import UsageError
from rosz.node import Node

T = TypeVar("T")

_EVERYWHERE = ("", "0.0.0.0")  # noqa: S104  # what foxglove_bridge's parameter may be


def serve_foxglove() -> None:
    """Serve the Foxglove protocol as the parameters of the node say, until the node ends.

    The parameters have the names of foxglove_bridge: ``~port``, ``~address``, ``~tls``,
    ``~certfile``, ``~keyfile``, ``~topic_whitelist``, ``~service_whitelist``, ``~param_whitelist``,
    ``~client_topic_whitelist``, ``~send_buffer_limit``, ``~include_hidden``, ``~capabilities``,
    ``~asset_uri_allowlist``. Those of its threads and intervals are ignored. ``~password_file``
    names a file whose first line clients must know; without one, a random password is printed if
    the address is not one of this machine alone.

    Raises:
        RoszError: A parameter is not valid, or the port is in use.
    """
    with Node("foxglove_bridge") as node:
        address = _get(node, "address", "127.0.0.1")
        tls = _get(node, "tls", default=False)
        certificate, key = _get(node, "certfile", ""), _get(node, "keyfile", "")
        if tls and not (certificate and key):
            raise UsageError("'~tls' is true: '~certfile' and '~keyfile' have to name files, too")
        settings = FoxgloveSettings(
            host="0.0.0.0" if address in _EVERYWHERE else address,  # noqa: S104  # as asked
            port=_get(node, "port", PORT),
            password_file=_get(node, "password_file", ""),
            topics=_patterns(node, "topic_whitelist"),
            services=_patterns(node, "service_whitelist"),
            params=_patterns(node, "param_whitelist"),
            published=_patterns(node, "client_topic_whitelist"),
            certificate=certificate if tls else "",
            key=key if tls else "",
            limits=FoxgloveLimits(
                waiting=_get(node, "send_buffer_limit", FoxgloveLimits().waiting)
            ),
            offer=Offer(
                _capabilities(node),
                _get(node, "include_hidden", default=False),
                _patterns(node, "asset_uri_allowlist") or SHOWN,
            ),
        )
        bridge, lines = open_bridge(node, settings)
        with bridge:
            for line in lines:
                node.log.info("%s", line)
            node.spin()


def _get(node: Node, name: str, default: T) -> T:
    """Return a parameter of the type of its default."""
    value = node.params.get(f"~{name}", default)
    if type(value) is not type(default):
        raise UsageError(f"parameter '~{name}' is {value!r}: expected a value such as {default!r}")
    return value


def _names(node: Node, name: str) -> tuple[str, ...]:
    value: Any = node.params.get(f"~{name}", [])
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str) for name in names):
        raise UsageError(f"parameter '~{name}' is {value!r}: expected a list of texts")
    return tuple(names)


def _patterns(node: Node, name: str) -> tuple[re.Pattern[str], ...]:
    """Return the regular expressions in a parameter; none means all."""
    patterns = []
    for text in _names(node, name):
        try:
            patterns.append(re.compile(text, re.ASCII))
        except re.error as error:
            raise UsageError(
                f"parameter '~{name}' has {text!r}, which is not a regular expression: {error}"
            ) from error
    return tuple(patterns)


def _capabilities(node: Node) -> tuple[str, ...]:
    names = _names(node, "capabilities")
    if unknown := set(names) - {*CAPABILITIES, "time"}:
        raise UsageError(
            f"parameter '~capabilities' has '{unknown.pop()}': expected some of"
            f" {', '.join(CAPABILITIES)}"
        )
    return tuple(feature for feature in CAPABILITIES if feature in names) if names else CAPABILITIES
