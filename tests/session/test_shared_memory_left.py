"""Shared memory that killed processes left behind is removed; what is in use stays."""

from __future__ import annotations

import fcntl
import os
import sys
from pathlib import Path

import pytest
from network import Network, eventually

from rosz.session.zenoh_workarounds import SEGMENTS, remove_abandoned_segments

TALKER = """
    import rosz
    from rosz.msgs.sensor_msgs.msg import Image
    node = rosz.Node("talker")
    images = node.publisher("images", Image)
    images.wait_for_subscribers()
    for _ in node.rate(100):
        images.publish(data=bytes(200_000))
"""
LISTENER = """
    import os, pathlib, rosz
    from rosz.msgs.sensor_msgs.msg import Image
    node = rosz.Node("listener")
    for image in node.subscription("images", Image):
        mapped = pathlib.Path("/proc/self/maps").read_text().split()
        print("mapped", *{os.path.basename(m) for m in mapped if m.endswith(".zenoh")})
"""


def test_what_nobody_uses_goes(tmp_path: Path) -> None:
    (tmp_path / "1.zenoh").touch()
    assert remove_abandoned_segments(tmp_path, min_age=-1) == ["1.zenoh"]
    assert list(tmp_path.iterdir()) == []


def test_what_somebody_uses_stays(tmp_path: Path) -> None:
    path = tmp_path / "1.zenoh"
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        assert remove_abandoned_segments(tmp_path, min_age=-1) == []
    assert remove_abandoned_segments(tmp_path, min_age=-1) == ["1.zenoh"]


def test_what_is_just_being_made_stays(tmp_path: Path) -> None:
    (tmp_path / "1.zenoh").touch()
    assert remove_abandoned_segments(tmp_path, min_age=60) == []


def test_other_files_stay(tmp_path: Path) -> None:
    (tmp_path / "sem.other").touch()
    assert remove_abandoned_segments(tmp_path, min_age=-1) == []


def test_where_there_is_no_shared_memory_nothing_happens(tmp_path: Path) -> None:
    assert remove_abandoned_segments(tmp_path / "none") == []


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /dev/shm and /proc")
def test_killed_nodes_leave_nothing(network: Network) -> None:
    listener = network.program(LISTENER, ROSZ_SHM="100000")
    talker = network.program(TALKER, ROSZ_SHM="100000")
    names = listener.wait_for("mapped ").split()[1:]
    assert names, "samples do not go by shared memory"
    for program in (talker, listener):
        program.kill()
    left = [SEGMENTS / name for name in names]
    assert any(map(os.path.exists, left)), "killed processes leave nothing: nothing to remove"

    def gone() -> bool:
        remove_abandoned_segments()  # not those that other tests are just making
        return not any(map(os.path.exists, left))

    eventually(gone, "what they left goes once it is old enough")


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /dev/shm and /proc")
def test_the_next_session_removes_them(network: Network) -> None:
    stale = SEGMENTS / f"{os.getpid()}0.zenoh"
    stale.touch()

    def gone() -> bool:
        network.session().close()
        return not stale.exists()

    eventually(gone, "a stale segment goes once it is old enough")
