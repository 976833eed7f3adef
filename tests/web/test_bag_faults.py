"""Recorders and players that stand still or have no room: the page says so, and goes on."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
from network import TIMEOUT, Network, eventually

from rosz.access import PagePolicy
from rosz.msgs.std_msgs.msg import String
from rosz.web.model import BagCommand, BagRun, Bags, PlayOrder, RecordOrder
from rosz.web.pages.bags import fault_of

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]
LONG = 4 * TIMEOUT


@pytest.fixture
def bags(network: Network, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Bags:
    """A folder of bags, whose processes are on the network of the test."""
    for name, value in network.variables().items():
        monkeypatch.setenv(name, value)
    network.node("robot").publisher("big", String, latch=True).publish(String("x" * 200_000))
    return Bags(tmp_path, PagePolicy())


def recorded(bags: Bags, name: str) -> BagRun:
    """Return a recording that has its message."""
    bags.record(RecordOrder(name=name, topics=("/big",)))
    run = bags.recording
    assert run is not None
    eventually(lambda: run.last.messages or run.ended, "the message, or a fault", LONG)
    return run


def finish(bags: Bags, run: BagRun) -> None:
    bags.stop_recording()
    assert run.wait(LONG)
    assert (run.fault, fault_of(run)) == ("", "")


def test_processes_that_stand_still_are_killed(bags: Bags, monkeypatch: pytest.MonkeyPatch) -> None:
    finish(bags, recorded(bags, "first.mcap"))
    second = recorded(bags, "second.mcap")
    bags.play(PlayOrder(name="first.mcap", paused=True))
    player = bags.playing
    assert player is not None
    eventually(lambda: player.last.paused, "the player", LONG)
    for run in (second, player):
        os.kill(run._process.pid, signal.SIGSTOP)
    with monkeypatch.context() as patch:
        patch.setattr("rosz.web.model.bags._SILENT_SECONDS", 2.0)
        for run in (second, player):
            eventually(lambda run=run: run.silent, "its silence", LONG)  # type: ignore[misc]
            assert fault_of(run) == "Its process does not respond; 'Stop' kills it."
        bags.stop_recording()
        bags.control(BagCommand("stop"))
        for run in (second, player):
            assert run.wait(LONG)
            assert "did not respond" in fault_of(run)
    assert "rosz bag reindex" in second.fault
    finish(bags, recorded(bags, "third.mcap"))
    bags.close()


def test_a_full_disk_is_said_and_room_is_used_again(bags: Bags, tmp_path: Path) -> None:
    mount = ["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", str(tmp_path)]
    if os.geteuid() or subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("needs to mount a small disk, as root")
    try:
        bags.record(RecordOrder(name="full.mcap", topics=("/big",)))
        run = bags.recording
        assert run is not None
        eventually(lambda: run.ended, "the end of the recording", LONG)
        assert "No space left on device" in fault_of(run)
        for one in tmp_path.iterdir():
            one.unlink()
        subprocess.run(["mount", "-o", "remount,size=4m", str(tmp_path)], check=True)
        finish(bags, recorded(bags, "whole.mcap"))
        assert "/big" in {one.topic for one in bags.folder.summary("whole.mcap")[0].topics}
    finally:
        bags.close()
        subprocess.run(["umount", "-l", str(tmp_path)], check=True)
