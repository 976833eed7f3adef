"""The arguments of the Master API and the Parameter Server API, checked as ROS 1's master does."""

from __future__ import annotations

import socket
import time
from typing import Any
from urllib.parse import urlsplit

from rosz import names
from rosz.bridges.ros1.registry import ANY_TYPE
from rosz.bridges.ros1.sockets import Stream

_INTEGERS = range(-(1 << 31), 1 << 31)
_KNOWN_SECONDS = 30.0
"""Seconds for which a result is cached: the lookup of a host may take as long as its timeout."""
_MAX_HOSTS = 1000  # bounds the cache, because any program may name new hosts


class InvalidArgument(Exception):
    """A method refuses an argument; the text is sent to the caller."""


class ArgumentChecker:
    """Checks the arguments of calls, and replaces hosts in URIs that this machine cannot reach."""

    def __init__(self) -> None:
        self._hosts: dict[tuple[str, str], tuple[float, str]] = {}

    def check(self, given: tuple[Any, ...], kinds: tuple[str, ...], stream: Stream) -> list[Any]:
        """Return the arguments for a method: the caller, the stream, and the checked others.

        Args:
            given: Arguments of the call.
            kinds: Kinds of the arguments after the caller.
            stream: Stream of the call.

        Raises:
            InvalidArgument: The number or the kind of the arguments is wrong.
            InvalidName: A name or type is too long.
        """
        if not given:
            raise InvalidArgument("missing required caller_id parameter")
        caller, *others = given
        if len(others) != len(kinds):
            raise InvalidArgument("Error: bad call arity")
        if not isinstance(caller, str):
            raise InvalidArgument("caller_id must be a string")
        names.check_length(caller)
        checked = [
            self._check_one(kind, value, caller, stream)
            for kind, value in zip(kinds, others, strict=True)
        ]
        return [caller, stream, *checked]

    def _check_one(self, kind: str, value: Any, caller: str, stream: Stream) -> Any:
        """Return an argument as the methods expect it: names resolved, URIs reachable."""
        if kind == "value":
            return value
        if not isinstance(value, str) or not (value or kind == "namespace"):
            raise InvalidArgument(f"ERROR: parameter [{kind}] must be a non-empty string")
        match kind:
            case "uri":
                return self._reachable(value, stream)
            case "type":
                names.check_length(value)
                if value != ANY_TYPE and value.count("/") != 1:
                    raise InvalidArgument(
                        "ERROR: parameter [type] is not a valid package resource name"
                    )
            case "name":
                if ":" in value or " " in value:
                    raise InvalidArgument("ERROR: parameter [name] contains illegal chars")
                if value == "/":
                    raise InvalidArgument("ERROR: parameter [name] cannot be the global namespace")
                return names.resolve(value, caller)
            case "namespace":
                return names.resolve(value, caller) if value else ""
        return value

    def _reachable(self, uri: str, stream: Stream) -> str:
        """Return a URI that can be reached from this machine.

        The host is replaced by the address of the caller if its name cannot be resolved, or if it
        resolves to this machine although the caller runs on another machine.
        """
        try:
            parts = urlsplit(uri)
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise InvalidArgument(f"ERROR: '{uri:.200}' is not an RPC URI: {error}") from error
        if parts.scheme not in {"http", "rosrpc"} or not host or not port:
            raise InvalidArgument(f"ERROR: parameter [{uri:.200}] is not an RPC URI")
        if len(self._hosts) > _MAX_HOSTS:
            self._hosts.clear()
        now = time.monotonic()
        expires, reachable = self._hosts.get((host, stream.host), (0.0, ""))
        if expires < now:
            reachable = _reachable_host(host, stream.host)
            self._hosts[host, stream.host] = now + _KNOWN_SECONDS, reachable
        return uri if reachable == host else f"{parts.scheme}://{reachable}:{port}{parts.path}"


def _reachable_host(host: str, caller: str) -> str:
    """Return a host name, or the address of the caller if the name is of no use here."""
    try:
        addresses = {str(info[4][0]) for info in socket.getaddrinfo(host, None, socket.AF_INET)}
    except (OSError, UnicodeError):
        return caller
    is_local = all(address.startswith("127.") for address in addresses)
    return caller if is_local and not caller.startswith("127.") else host


def check_integers(value: Any, key: str) -> None:
    """Refuse a value with an integer that ROS 1's programs cannot read.

    Raises:
        InvalidArgument: An integer needs more than 32 bits.
    """
    match value:
        case bool():
            return
        case int() if value not in _INTEGERS:
            raise InvalidArgument(
                f"parameter [{key}]: {value} exceeds the 32 bits of XML-RPC's integers"
            )
        case list():
            for element in value:
                check_integers(element, key)
        case dict():
            for member in value.values():
                check_integers(member, key)
