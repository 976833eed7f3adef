"""Large samples by shared memory, and without it where there is none."""

from __future__ import annotations

import subprocess
import sys
from textwrap import dedent

import pytest
from network import Network, Program

TALKER = """
    import rosz
    from rosz.msgs.sensor_msgs.msg import Image
    node = rosz.Node("talker")
    images = node.publisher("images", Image, queue_size=0)
    images.wait_for_subscribers(timeout=50)
    for number in range(20):
        images.publish(height=number, data=bytes([number]) * 300_000)
    print("sent", flush=True)
    node.spin()
"""
LISTENER = """
    import pathlib, rosz
    from rosz.msgs.sensor_msgs.msg import Image
    node = rosz.Node("listener")
    images = node.subscription("images", Image, queue_size=0)
    print("ready", flush=True)
    for number in range(20):
        image = images.get(50)
        assert image.height == number, f"{image.height} instead of {number}"
        assert image.data == bytes([number]) * 300_000, "damaged"
    print("shared:", ".zenoh" in pathlib.Path("/proc/self/maps").read_text(), flush=True)
"""
# Mounts a /dev/shm of a given size for this process only.
SMALL = ("unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o size=$0 none /dev/shm && exec "$@"')


def can_unshare() -> bool:
    if sys.platform != "linux":
        return False
    try:
        return (
            subprocess.run([*SMALL, "64k", "true"], check=False, capture_output=True).returncode
            == 0
        )
    except FileNotFoundError:
        return False


def exchanged(network: Network, threshold: str, *wrapper: str) -> str:
    """Send images from one program to another, and return what the receiver prints."""
    variables = network.variables(ROSZ_SHM=threshold)
    listener = network.program(LISTENER, ROSZ_SHM=threshold)
    listener.wait_for("ready")
    talker = Program([*wrapper, sys.executable, "-c", dedent(TALKER)], variables)
    try:
        line = listener.wait_for("shared: ")
        talker.wait_for("sent")
        assert listener.exit_code() == 0, listener.output
    finally:
        talker.close()
    return line


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize(("threshold", "shared"), [("100000", True), ("0", False)])
def test_switch(network: Network, threshold: str, shared: bool) -> None:
    assert exchanged(network, threshold) == f"shared: {shared}"


@pytest.mark.skipif(not can_unshare(), reason="needs Linux and the privilege to mount")
@pytest.mark.parametrize("size", ["64k", "1m", "64k,ro"], ids=["full", "nearly full", "read-only"])
def test_no_room(network: Network, size: str) -> None:
    """Where /dev/shm is full or read-only, everything arrives by links."""
    assert exchanged(network, "100000", *SMALL, size)


@pytest.mark.skipif(not can_unshare(), reason="needs Linux and the privilege to mount")
def test_no_room_at_the_start(network: Network) -> None:
    """A node starts without shared memory, and says so."""
    fill = "cat /dev/zero >/dev/shm/full 2>/dev/null; exec "
    full = (*SMALL[:-1], SMALL[-1].replace("exec ", fill), "64k")
    node = """
        import rosz
        with rosz.Node("full"):
            print("started", flush=True)
    """
    command = [*full, sys.executable, "-c", dedent(node)]
    program = Program(command, network.variables(ROSZ_SHM="1000"))
    try:
        program.wait_for("no shared memory: /dev/shm is full; samples go over links")
        program.wait_for("started")
        assert program.exit_code() == 0
    finally:
        program.close()
