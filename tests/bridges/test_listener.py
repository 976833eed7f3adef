"""What the bridges for websocket clients have in common."""

from __future__ import annotations

import socket
import ssl
import sys
from pathlib import Path
from typing import Any

import pytest
from network import Network

from rosz.access import AccessPolicy, ServerAccess
from rosz.bridges import foxglove, rosbridge
from rosz.errors import TransportError, UsageError

pytestmark = pytest.mark.system


@pytest.mark.parametrize(
    ("package", "make", "name"),
    [
        (foxglove, foxglove.FoxgloveSettings, "foxglove"),
        (rosbridge, rosbridge.RosbridgeSettings, "websocket"),
    ],
)
def test_settings(
    network: Network, monkeypatch: pytest.MonkeyPatch, package: Any, make: Any, name: str
) -> None:
    node = network.node("bridge")
    for settings, reason in (
        ({"port": 65536}, "port 65536: expected 0 to 65535"),
        ({"certificate": "a.pem"}, "give both"),
        ({"password_file": "/none"}, "cannot read the password in '/none'"),
        ({"certificate": "/none", "key": "/none"}, "for TLS"),
    ):
        with pytest.raises(UsageError, match=reason):
            package.open_bridge(node, make(**settings))
    empty: Path = network.folder / "password"
    empty.write_text("\n")
    with pytest.raises(UsageError, match="has no password"):
        package.open_bridge(node, make(password_file=str(empty)))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(TransportError, match=f"cannot listen at 127.0.0.1 port {port}"):
            package.open_bridge(node, make(port=port))
    monkeypatch.setitem(sys.modules, "websockets.asyncio.server", None)
    with pytest.raises(UsageError, match=rf"pip install 'rosz\[{name}\]'"):
        package.open_bridge(node, make(port=0))


@pytest.mark.parametrize(
    ("host", "password", "tls", "shown", "address"),
    [
        ("127.0.0.1", "", False, False, "ws://127.0.0.1:80"),
        ("::1", "", False, False, "ws://[::1]:80"),
        ("10.0.0.1", "pw", True, True, "wss://10.0.0.1:80/?token=pw"),
        ("10.0.0.1", "pw", True, False, "wss://10.0.0.1:80"),
        ("10.0.0.1", "pw", False, True, "ws://10.0.0.1:80/?token=pw"),
        ("127.0.0.1", "pw", False, True, "ws://127.0.0.1:80/?token=pw"),
        ("0.0.0.0", "", False, False, f"ws://{socket.gethostname()}:80"),
    ],
)
def test_addresses(host: str, password: str, address: str, *, tls: bool, shown: bool) -> None:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER) if tls else None
    lines = ServerAccess(host, AccessPolicy(password=password), shown, context).describe("ws", 80)
    assert lines[0] == address
    assert len(lines) == 1 + bool(password and not tls and host != "127.0.0.1")
