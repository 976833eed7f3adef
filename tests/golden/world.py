"""The world that commands are run in: a folder of packages and files, and three nodes or none."""

from __future__ import annotations

import re
import shlex
import signal
import socket
import subprocess
import sys
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Self

from cli.side_by_side.worlds import Outcome, Rosz

__all__ = ("GoldenWorld",)

_ROOT = Path(__file__).parents[2]
_ROBOT = Path(__file__).with_name("robot.py")
_LIMIT = 200.0
"""Seconds after which a command counts as hanging."""

_DOCTOR = """
import sys
from functools import partial
from pathlib import Path
import rosz.doctor
from rosz.__main__ import main
rosz.doctor.Examination = partial(rosz.doctor.Examination, memory=Path.cwd())
main()
"""
"""The command with a doctor who does not look at the shared memory of the whole machine."""

_MANIFEST = "<package><name>{}</name></package>"
_FILES = {
    "src/demo_pkg/scripts/beep.py": "#!/usr/bin/env python3\nimport sys\nprint(sys.argv[1:])\n",
    "src/demo_pkg/launch/demo.launch": """<launch>
  <arg name="rate" default="2" doc="how often"/>
  <arg name="topic"/>
  <param name="rate" value="$(arg rate)"/>
  <rosparam>{robot: {wheels: [1, 2.5], name: r2}}</rosparam>
  <include file="$(dirname)/more.xml" ns="more" if="$(eval arg('rate') > 1)"/>
  <node pkg="demo_pkg" type="beep.py" name="talker" ns="a" args="$(arg topic)" output="screen">
    <env name="X" value="1 2"/>
    <remap from="in" to="/out"/>
    <param name="gain" type="double" value="3"/>
  </node>
</launch>
""",
    "src/demo_pkg/launch/more.xml": """<launch>
  <node pkg="demo_pkg" type="beep.py" name="listener" required="true" respawn="false"/>
  <test pkg="demo_pkg" type="beep.py" test-name="check"/>
</launch>
""",
    "broken/broken_pkg/package.xml": _MANIFEST.format("broken_pkg"),
    "broken/broken_pkg/msg/Bad.msg": "int32 good\nint33 bad\n",
    "broken/broken_pkg/launch/bad.launch": '<launch>\n  <node pkg="x" type="y"/>\n</launch>\n',
    "broken/no_xml.launch": "<launch>\n  <node\n</launch>\n",
    "broken/no_tag.launch": "<launch>\n  <nodes/>\n</launch>\n",
    "broken/no_arg.launch": '<launch>\n  <param name="x" value="$(arg y)"/>\n</launch>\n',
    "broken/ring.launch": '<launch>\n  <include file="$(dirname)/ring.launch"/>\n</launch>\n',
    "broken/no_package.launch": '<launch>\n  <node pkg="x" type="y" name="z"/>\n</launch>\n',
    "bad.yaml": "a: 1\nb: [1, 2\nc: 3\n",
    "good.yaml": "robot:\n  name: r4\n  arms: {left: 1, right: 0x10}\n",
    "keys.yaml": "robot:\n  on: true\n",
    "texts.yaml": "data: one\n---\ndata: two\n",
    "text.txt": "some text\n",
    "sh.launch": '<launch><param name="p" command="false"/></launch>\n',
}

_VARIABLE = [
    (re.compile(pattern, re.MULTILINE), text)
    for pattern, text in (
        (rf"\b{re.escape(socket.gethostname())}\b", "<host>"),
        (r"(?<=pid )\d+|(?<=Pid: )\d+|(?<=\"pid\": )\d+", "<pid>"),
        (r"(?<=\"session\": \")[0-9a-f]+", "<id>"),
        (r"(?<=time=)[\d.]+(?=ms)", "<t>"),
        (r"(?<=average: )[\d.]+(?=ms)", "<t>"),
        (r"\b1\d{18}\b", "<nanoseconds>"),
        (r"\b1\d{9}\.\d+\b", "<seconds>"),
        (r"(?<=secs: )-?1\d{9}(\n *nsecs:) +\d+", r"<s>\1 <ns>"),
        (r"\b[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}\b", "<run>"),
        (r"(?<=-)\d+(?=\.log\b)", "<pid>"),
        (r"^\d{4}-\d\d-\d\d[ T][\d:.]+", "<date>"),
    )
]
_TOO_EARLY = "no new messages\n"
"""What a measurement prints on a busy machine before the first message."""

_MEASURES = ("topic hz", "topic bw", "topic delay")
_FIGURE = re.compile(r"\d[\d.]*(?:e-?\d+)?(?:[KM]?B(?:/s)?)?")


class GoldenWorld(Rosz):
    """Packages, files and, if wanted, nodes.

    Args:
        nodes: Whether there are any.
    """

    def __init__(self, *, nodes: bool) -> None:
        super().__init__()
        self._nodes = nodes
        self.environ |= {
            "COLUMNS": "100",
            "ROS_PACKAGE_PATH": f"{self.folder}/src",
            "SHELL": "/bin/bash",
            "USER": "somebody",
        }
        for name, text in _FILES.items():
            file = self.folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        (self.folder / "src/demo_pkg/scripts/beep.py").chmod(0o755)

    def __enter__(self) -> Self:
        if not self._nodes:
            return self
        with ExitStack() as stack:
            stack.push(self)
            super().__enter__()
            self.start(sys.executable, str(_ROBOT)).wait_for("ready", _LIMIT)
            stack.pop_all()
        return self

    def answer(self, line: str) -> str:
        """Run a command and return what came of it, without what differs from run to run.

        Args:
            line: The command without ``rosz``. ``<<< text`` is what it reads; ``| head -3`` means
                that it gets SIGINT after three lines.
        """
        words, _, text = line.partition(" <<< ")
        words, _, count = words.partition(" | head -")
        program = ["-c", _DOCTOR] if words.startswith("doctor") else ["-m", "rosz"]
        with subprocess.Popen(
            [sys.executable, *program, *shlex.split(words)],
            env=self.environ,
            cwd=self.folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            watchdog = threading.Timer(_LIMIT, process.kill)
            watchdog.start()
            if count:
                outcome = _beginning(process, int(count))
            else:
                out, err = process.communicate(text.replace("\\n", "\n"))
                outcome = Outcome(process.wait(), out, err)
            watchdog.cancel()
        parts = [f"$ rosz {line}\n", self._plain(words, outcome.out)]
        if outcome.err:
            parts += ["--- stderr\n", self._plain(words, outcome.err)]
        return "".join([*parts, f"--- exit {outcome.code}\n\n"])

    def _plain(self, line: str, text: str) -> str:
        for path, name in (
            (str(self.folder), "<folder>"),
            (sys.executable, "<python>"),
            (str(_ROOT), "<rosz>"),
        ):
            text = text.replace(path, name)
        for pattern, name in _VARIABLE:
            text = pattern.sub(name, text)
        if line.startswith(_MEASURES):
            text = _FIGURE.sub("<x>", text)
        return text if text.endswith("\n") or not text else f"{text}\\\n"


def _beginning(process: subprocess.Popen[str], count: int) -> Outcome:
    """Return the first lines, of both streams, of what goes on for ever, and end it then."""
    lines: dict[str, list[str]] = {"out": [], "err": []}
    left = iter(range(count - 1, -1, -1))
    lock = threading.Lock()

    def read(name: str, stream: IO[str]) -> None:
        for line in stream:
            with lock:
                more = None if line == _TOO_EARLY else next(left, None)
                if more is not None:
                    lines[name].append(line)
                if more == 0:
                    process.send_signal(signal.SIGINT)

    assert process.stdout is not None
    assert process.stderr is not None
    readers = [
        threading.Thread(target=read, args=("out", process.stdout)),
        threading.Thread(target=read, args=("err", process.stderr)),
    ]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    return Outcome(process.wait(), "".join(lines["out"]), "".join(lines["err"]))
