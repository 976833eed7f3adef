"""``rosz bag`` as users start it: on a terminal, and in launch files."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually

import rosz.bags
from rosz.msgs.std_msgs.msg import Int32

pytestmark = pytest.mark.system

SECOND = 1_000_000_000
LAUNCH = """
<launch>
  <node pkg="rosbag" type="record" name="rec" required="true" args="-O out -l 20 /there"/>
  <node pkg="rosbag" type="play" name="play" args="--wait-for-subscribers -i {bag}">
    <remap from="/a" to="/there"/>
  </node>
</launch>
"""


def _bag(path: Path, seconds: float) -> Path:
    with rosz.bags.open(path, "w") as bag:
        for number in range(20):
            bag.write("/a", Int32(data=number), round((100 + number * seconds) * SECOND))
    return path


class _Keys:
    """A command on a terminal."""

    def __init__(self, command: list[str], variables: dict[str, str]) -> None:
        self._ours, theirs = pty.openpty()
        self.text = ""
        self.process = subprocess.Popen(
            command, env=variables, stdin=theirs, stdout=theirs, stderr=theirs
        )
        os.close(theirs)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._ours, 4096)
            except OSError:  # the other side is closed
                return
            self.text += data.decode()

    def press(self, key: str, expected: Callable[[str], object]) -> None:
        """Press a key, and wait until what is written since fulfils a condition."""
        begin = len(self.text)
        os.write(self._ours, key.encode())
        eventually(lambda: expected(self.text[begin:]), f"after {key!r}")

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join()
        os.close(self._ours)


def test_keys_and_progress_on_a_terminal(network: Network) -> None:
    bag = _bag(network.folder / "x.mcap", 60.0)
    found: list[int] = []
    network.node("listener").subscription("/a", Int32, lambda message: found.append(message.data))
    command = [sys.executable, "-m", "rosz", "bag", "play", "--pause", str(bag)]
    words = ["--wait-for-subscribers", "--clock", "-r", "1"]
    keys = network._keep(_Keys([*command, *words], network.variables(TERM="xterm")))
    eventually(lambda: "[PAUSED ]  Bag Time:" in keys.text)
    assert "Hit space to toggle paused, or 's' to step." in keys.text
    keys.press("s", lambda _: found == [0])
    keys.press("s", lambda _: found == [0, 1])
    keys.press("s", lambda _: found == [0, 1, 2])
    keys.press("\x1b[A", lambda text: "1.10 x" in text)
    keys.press("\x1b[B\x1b[B", lambda text: "0.91 x" in text)
    keys.press(" ", lambda text: "[RUNNING]" in text)
    keys.press(" ", lambda text: "[PAUSED ]" in text)
    assert re.search(r"Duration: 12\d\.\d{6} / 1140\.000000   \[##\.{18}\]", keys.text)
    keys.process.send_signal(signal.SIGINT)
    assert keys.process.wait(TIMEOUT) == 0
    assert "Traceback" not in keys.text


def test_nodes_of_launch_files_play_and_record(network: Network) -> None:
    bag = _bag(network.folder / "x.mcap", 0.01)
    file = network.folder / "x.launch"
    file.write_text(LAUNCH.format(bag=bag))
    command = [sys.executable, "-m", "rosz", "launch", str(file)]
    variables = network.variables(ROS_HOME=str(network.folder))
    program = network._keep(Program(command, variables, network.folder))
    program.exit_code(60)
    with rosz.bags.open(network.folder / "out.mcap") as made:
        found: list[Any] = [one.message for one in made.messages("/there")]
    assert [one.data for one in found] == list(range(20))
    assert not list(network.folder.glob("*.active"))
