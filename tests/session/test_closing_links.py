from __future__ import annotations

import os
import socket
import stat
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest
from network import eventually, free_port

from rosz.session import LocalPeers, Session, SessionConfig
from rosz.session.opening import open_raw


def open_files() -> list[int]:
    return [int(file.name) for file in Path("/dev/fd").iterdir()]


def lingering() -> Iterator[tuple[int, bool]]:
    """Yield the local port of each connection of this process, and whether closing it may wait."""
    for number in open_files():
        with suppress(OSError):
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                continue
            with socket.socket(fileno=os.dup(number)) as found:
                if isinstance(found.getpeername(), tuple):
                    option = found.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8)
                    yield found.getsockname()[1], bool(struct.unpack("ii", option)[0])


def settings(port: int, host: str) -> tuple[SessionConfig, SessionConfig]:
    """Return what two sessions are, one of which listens."""
    unused = "tcp/127.0.0.1:1"
    hub = SessionConfig(mode="router", rendezvous=f"tcp/{host}:{port}")
    leaf = SessionConfig(mode="client", rendezvous=unused, connect=(f"tcp/127.0.0.1:{port}",))
    return hub, leaf


@pytest.fixture
def port() -> int:
    return free_port()


def has_ipv6() -> bool:
    with suppress(OSError), socket.create_server(("::1", 0), family=socket.AF_INET6):
        return True
    return False


@pytest.mark.parametrize(
    "host",
    [
        "0.0.0.0",
        pytest.param("[::]", marks=pytest.mark.skipif(not has_ipv6(), reason="needs IPv6")),
        "127.0.0.1",
    ],
)
def test_links_close_at_once(port: int, host: str) -> None:
    hub, leaf = settings(port, host)
    with Session.open(hub), Session.open(leaf):
        eventually(lambda: (port, False) in lingering(), "a link that does not linger")
    with Session.open(hub):
        for _ in range(3):
            with Session.open(leaf):
                eventually(lambda: (port, False) in lingering(), "the same for a later link")


def test_no_file_stays_open(port: int) -> None:
    hub, leaf = settings(port, "0.0.0.0")
    with Session.open(hub):
        counts = set()
        for _ in range(3):
            with Session.open(leaf):
                eventually(lambda: (port, False) in lingering(), "the link")
                counts.add(len(open_files()))
    assert max(counts) - min(counts) < 5, counts


def test_a_link_lingers_by_itself(port: int) -> None:
    """Otherwise the workaround is not needed any more."""
    hub, leaf = settings(port, "127.0.0.1")
    with open_raw(hub, LocalPeers.read(hub.rendezvous)), Session.open(leaf):
        assert (port, True) in lingering()


@pytest.mark.parametrize("dials", [True, False])
def test_a_silent_other_end_delays_nothing(
    port: int, caplog: pytest.LogCaptureFixture, *, dials: bool
) -> None:
    """Zenoh would give up after ten seconds, and a warning tells that."""
    hub = SessionConfig(mode="router", rendezvous=f"tcp/127.0.0.1:{port}")
    hour = "transport/unicast/open_timeout=3600000;transport/unicast/accept_timeout=3600000"
    with socket.create_server(("127.0.0.1", 0)) as server:
        place = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        config = msgspec.structs.replace(hub, connect=(place,) * dials, override=hour)
        session = Session.open(config)
        other = server.accept()[0] if dials else socket.create_connection(("127.0.0.1", port))
        with other:
            if not dials:
                eventually(lambda: port in dict(lingering()), "that it is accepted")
            session.close()
    assert not caplog.records
