"""Faults of the machine and of where it is pointed to, each injected and named."""

from __future__ import annotations

import fcntl
import socket
from collections.abc import Iterator

import pytest
from network import Network, free_port

from rosz.doctor.machine import check_segments
from rosz.session import why_refused

from .conftest import Doctor


@pytest.fixture
def mute() -> Iterator[str]:
    """An endpoint that takes connections and says nothing."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture
def closed() -> str:
    """An endpoint that nobody listens at."""
    return f"tcp/127.0.0.1:{free_port()}"


def test_nobody_at_all_is_no_error(doctor: Doctor) -> None:
    found = doctor()
    assert list(found) == ["nobody-there"]
    assert found["nobody-there"].level == "warning"


def test_a_rendezvous_held_by_something_else(doctor: Doctor, mute: str) -> None:
    finding = doctor(rendezvous=mute)["rendezvous-held"]
    assert finding.level == "error"
    assert mute in finding.text
    assert "ROSZ_RENDEZVOUS" in finding.remedy


def test_nobody_listens_where_connect_points(
    doctor: Doctor, network: Network, closed: str, mute: str
) -> None:
    network.node("talker")
    finding = doctor(connect=(closed,))["nobody-listens"]
    assert closed in finding.text
    assert finding.evidence == ("Connection refused",)
    assert "says nothing within" in doctor(connect=(mute,))["nobody-listens"].evidence[0]
    unknown = doctor(connect=("tcp/no-such-robot.invalid:7447",))["nobody-listens"]
    assert "the name 'no-such-robot.invalid' is not known" in unknown.evidence[0]


def test_somebody_listens_where_connect_points(doctor: Doctor, network: Network) -> None:
    network.node("talker")
    assert doctor(connect=(network.rendezvous,)) == {}


@pytest.mark.parametrize(
    ("endpoint", "reason"),
    [
        ("tcp/127.0.0.1", "has no port"),
        ("unixsock-stream//nowhere/z.sock", "No such file or directory"),
        ("udp/127.0.0.1:1", ""),
    ],
)
def test_why_an_endpoint_refuses(endpoint: str, reason: str) -> None:
    assert reason in why_refused(endpoint)


def test_a_package_path_that_leads_nowhere(doctor: Doctor, network: Network) -> None:
    network.node("talker")
    file = network.folder / "file"
    file.touch()
    roots = (network.folder, network.folder / "gone", file)
    found = doctor(package_roots=roots)["missing-path"]
    assert found.level == "warning"
    assert found.evidence == (f"{roots[1]}: it does not exist", f"{file}: it is a file")
    assert doctor(package_roots=roots[:1]) == {}


def test_a_namespace_that_nodes_refuse(doctor: Doctor, network: Network) -> None:
    network.node("talker")
    finding = doctor(namespace="/my robot")["refused-name"]
    assert "ROS_NAMESPACE is '/my robot'" in finding.text
    assert "character ' ' at position 4" in finding.evidence[0]
    assert doctor(namespace="/my_robot") == {}


def test_shared_memory_that_is_full(doctor: Doctor, network: Network) -> None:
    (network.folder / "big.zenoh").write_bytes(bytes(1000))
    finding = doctor(least_free=1 << 60)["shared-memory-full"]
    assert finding.level == "error"
    assert str(network.folder) in finding.text
    assert any("big.zenoh" in line for line in finding.evidence)
    assert "shared-memory-full" not in doctor()


def test_segments_of_dead_processes(network: Network) -> None:
    segment = network.folder / "1.zenoh"
    segment.write_bytes(bytes(4))
    (finding,) = check_segments(network.folder, born=-1)
    assert (finding.name, finding.level) == ("stale-lock", "warning")
    assert finding.text == "1 segment of shared memory left by processes that died"
    assert finding.evidence == (f"{segment}, 4 bytes",)
    (network.folder / "2.zenoh").write_bytes(b"")
    (finding,) = check_segments(network.folder, born=-1)
    assert finding.text.startswith("2 segments of ")


def test_segments_in_use_are_none(network: Network) -> None:
    segment = network.folder / "1.zenoh"
    segment.write_bytes(bytes(4))
    holder = network.program(
        """
        import fcntl, sys
        file = open(sys.argv[1])
        fcntl.flock(file, fcntl.LOCK_SH)
        print("held", flush=True)
        sys.stdin.read()
        """,
        str(segment),
    )
    holder.wait_for("held")
    assert list(check_segments(network.folder, born=-1)) == []


def test_the_socket_of_a_dead_process(doctor: Doctor, network: Network) -> None:
    holder = network.program(
        """
        import rosz
        node = rosz.Node("holder")
        print("up", flush=True)
        node.spin()
        """
    )
    holder.wait_for("up")
    assert doctor() == {}
    holder.kill()
    finding = doctor()["stale-lock"]
    assert finding.level == "warning"
    assert "Connection refused" in finding.evidence[0]


def test_a_socket_that_the_next_cannot_take(doctor: Doctor, network: Network) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(network.folder / "z.sock"))
    with (network.folder / "z.sock.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        finding = doctor()["stale-lock"]
    assert finding.level == "error"
    assert "held by another process" in finding.evidence[1]
