"""Endpoints: the parts of their text, and errors about it."""

from __future__ import annotations

import pytest

from rosz.errors import UsageError
from rosz.wire import Endpoint


@pytest.mark.parametrize(
    ("text", "protocol", "host", "port"),
    [
        ("tcp/localhost:7447", "tcp", "localhost", 7447),
        ("tls/[fe80::1]:7447#iface=eth0", "tls", "fe80::1", 7447),
        ("tcp/[::]:0?prio=1", "tcp", "::", 0),
        ("tcp/robot1", "tcp", "", None),
        ("tcp/robot1:x", "tcp", "robot1", None),
        ("tcp/robot1:65536", "tcp", "robot1", None),
        ("quic/robot1:7447", "quic", "robot1", 7447),
        ("nonsense", "nonsense", "", None),
    ],
)
def test_parts(text: str, protocol: str, host: str, port: int | None) -> None:
    endpoint = Endpoint(text)
    assert (endpoint.protocol, endpoint.host, endpoint.port) == (protocol, host, port)
    assert str(endpoint) == text


def test_unix_socket() -> None:
    endpoint = Endpoint("unixsock-stream//run/z.sock")
    assert endpoint.is_unix
    assert endpoint.address == "/run/z.sock"


@pytest.mark.parametrize(
    ("text", "local"),
    [
        ("tcp/localhost:7447", True),
        ("tcp/127.0.0.53:7447", True),
        ("tcp/[::1]:7447", True),
        ("unixsock-stream//run/z.sock", True),
        ("tcp/0.0.0.0:7447", False),
        ("udp/robot1:7447", False),
    ],
)
def test_local(text: str, local: bool) -> None:
    assert Endpoint(text).is_local == local


def test_from_parts() -> None:
    assert str(Endpoint.of("tcp", "::1", 7447)) == "tcp/[::1]:7447"
    assert str(Endpoint.of("tcp", "robot1", 7447).on_interface("eth0")) == (
        "tcp/robot1:7447#iface=eth0"
    )


@pytest.mark.parametrize("text", ["serial//dev/ttyUSB0", "udp/[::1]:9", "unixpipe/x"])
def test_valid_endpoints(text: str) -> None:
    assert Endpoint.parse(text, "ROSZ_CONNECT") == Endpoint(text)


@pytest.mark.parametrize("text", ["", "tcp", "tcp/", "tcp/a", "tcp/a:b", "tcp/a:65536", "http/a:1"])
def test_invalid_endpoints(text: str) -> None:
    with pytest.raises(UsageError, match=r"ROSZ_CONNECT is .*expected PROTOCOL/ADDRESS"):
        Endpoint.parse(text, "ROSZ_CONNECT")
