"""How long launches take, beside real roslaunch: ``python tests/bench/launch [ROUNDS]``.

Each figure is measured for both in turn, round by round, and the median is printed with the ratio.
Where roslaunch is not installed, only rosz is measured.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))

from rosz.launch.run.process_tree import TAG, ProcessTree  # noqa: E402  # of this tree

ROSZ = [sys.executable, "-P", "-m", "rosz", "launch"]
TIMEOUT = 60.0
TALKERS = 20
MANY = 100

ROSPY_TALKER = """#!/usr/bin/python3
import rospy
from std_msgs.msg import String
rospy.init_node("talker")
chatter = rospy.Publisher("/chatter", String, queue_size=10)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    chatter.publish(rospy.get_name())
    rate.sleep()
"""
ROSPY_LISTENER = """#!/usr/bin/python3
import sys
import rospy
from std_msgs.msg import String
seen = set()
def hear(message):
    seen.add(message.data)
    if len(seen) == int(sys.argv[1]):
        print("all heard", flush=True)
rospy.init_node("listener")
rospy.Subscriber("/chatter", String, hear)
rospy.spin()
"""
ROSZ_TALKER = """#!/usr/bin/python3
import rosz
from std_msgs.msg import String
with rosz.Node("talker") as node:
    chatter = node.publisher("/chatter", String, queue_size=10)
    for _ in node.rate(20):
        chatter.publish(String(data=node.name))
"""
ROSZ_LISTENER = """#!/usr/bin/python3
import sys
import rosz
from std_msgs.msg import String
seen = set()
def hear(message):
    seen.add(message.data)
    if len(seen) == int(sys.argv[1]):
        print("all heard", flush=True)
with rosz.Node("listener") as node:
    node.subscription("/chatter", String, hear, queue_size=1000)
    node.spin()
"""
SLEEPER = """#!/usr/bin/python3
import sys, time
sys.stdout.write("up\\n")
sys.stdout.flush()
try:
    time.sleep(600)
except KeyboardInterrupt:
    pass
"""
STUBBORN = """#!/usr/bin/python3
import signal, sys, time
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_IGN)
sys.stdout.write("up\\n")
sys.stdout.flush()
time.sleep(600)
"""


class Bench:
    """A folder with packages and launch files, and the commands that run them.

    Args:
        folder: Where.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.real = shutil.which("roslaunch") is not None
        for name in ("home", "rosz", "ros"):
            (folder / name).mkdir()
        self.write(talker=ROSZ_TALKER, listener=ROSZ_LISTENER, to="rosz")
        self.write(talker=ROSPY_TALKER, listener=ROSPY_LISTENER, to="ros")
        for to in ("rosz", "ros"):
            self.write(sleeper=SLEEPER, stubborn=STUBBORN, to=to)
        self.fleet(
            "talkers",
            "talker",
            TALKERS,
            '<node pkg="fleet" type="listener.py" '
            f'name="listener" args="{TALKERS}" output="screen"/>',
        )
        self.fleet("sleepers", "sleeper", TALKERS)
        self.fleet("stubborn", "stubborn", TALKERS)
        self.fleet("many", "sleeper", MANY)
        self.parameters()

    def write(self, *, to: str, **scripts: str) -> None:
        package = self.folder / to / "fleet"
        package.mkdir(exist_ok=True)
        (package / "package.xml").write_text(
            "<package format='2'><name>fleet</name><version>0.0.1</version><description>d"
            "</description><maintainer email='a@b.c'>a</maintainer><license>MIT</license></package>"
        )
        for name, text in scripts.items():
            (package / f"{name}.py").write_text(text)
            (package / f"{name}.py").chmod(0o755)

    def fleet(self, name: str, script: str, count: int, extra: str = "") -> None:
        nodes = "\n".join(
            f'<node pkg="fleet" type="{script}.py" name="n{i}" output="screen"/>'
            for i in range(count)
        )
        self.path(name).write_text(f"<launch>{extra}{nodes}</launch>")

    def parameters(self) -> None:
        """Write 300 parameters in a file and five that it includes."""
        includes = []
        for file in range(5):
            lines = "\n".join(
                f'<param name="p{i}" value="{i * 1.5}"/>\n<param name="s{i}" value="text {i}"/>'
                for i in range(25)
            )
            self.path(f"part{file}").write_text(
                f'<launch><arg name="n"/><group ns="$(arg n)">{lines}</group></launch>'
            )
            includes.append(
                f'<include file="$(dirname)/part{file}.launch"><arg name="n" value="g{file}"/>'
                "</include>"
            )
        own = "\n".join(f'<param name="own/p{i}" value="{i}" type="int"/>' for i in range(50))
        self.path("parameters").write_text(f"<launch>{''.join(includes)}{own}</launch>")

    def path(self, name: str) -> Path:
        return self.folder / f"{name}.launch"

    @contextmanager
    def launch(self, which: str, *words: str) -> Iterator[subprocess.Popen[str]]:
        """Run one of the two while the block runs."""
        port = free_port()
        tag = secrets.token_hex(8)
        environ = {
            **os.environ,
            "HOME": str(self.folder / "home"),
            "ROS_HOME": str(self.folder / "home"),
            "ROS_IP": "127.0.0.1",
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROSZ_RENDEZVOUS": f"tcp/127.0.0.1:{port}",
            "ROS_PACKAGE_PATH": str(self.folder / which),
            "PYTHONPATH": str(ROOT) if which == "rosz" else "",
            "PYTHONUNBUFFERED": "1",
            TAG: tag,
        }
        command = ROSZ if which == "rosz" else ["roslaunch", "--skip-log-check"]
        with subprocess.Popen(
            [*command, *words],
            env=environ,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process:
            watchdog = threading.Timer(TIMEOUT, ProcessTree(tag).kill)
            watchdog.start()
            try:
                yield process
            finally:
                watchdog.cancel()
                if process.poll() is None:
                    process.send_signal(signal.SIGTERM)
                    process.communicate(timeout=TIMEOUT)
                ProcessTree(tag).kill()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def await_lines(process: subprocess.Popen[str], pattern: str, count: int = 1) -> str:
    """Read lines until so many match; return all that was read."""
    assert process.stdout is not None
    text = ""
    for line in process.stdout:
        text += line
        if len(re.findall(pattern, text)) >= count:
            return text
    raise SystemExit(f"no {pattern!r} ({count} times) in:\n{text}")


def dump(bench: Bench, which: str) -> float:
    begin = time.perf_counter()
    with bench.launch(which, "--dump-params", str(bench.path("parameters"))) as process:
        text, _ = process.communicate(timeout=TIMEOUT)
    assert len(text.splitlines()) >= 300, text
    return time.perf_counter() - begin


def first_messages(bench: Bench, which: str) -> float:
    begin = time.perf_counter()
    with bench.launch(which, str(bench.path("talkers"))) as process:
        await_lines(process, "all heard")
        return time.perf_counter() - begin


def ending(name: str, count: int, *options: str) -> Callable[[Bench, str], float]:
    """Return what measures the seconds from Ctrl-C to the end of all nodes."""

    def measure(bench: Bench, which: str) -> float:
        with bench.launch(which, str(bench.path(name)), *options) as process:
            text = await_lines(process, r"up\n", count)
            pids = [int(pid) for pid in re.findall(r"started with pid \[(\d+)\]", text)]
            begin = time.perf_counter()
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=TIMEOUT)
            seconds = time.perf_counter() - begin
        left = [pid for pid in pids if Path(f"/proc/{pid}").exists()]
        if left and which == "rosz":  # roslaunch does not wait for what it kills
            raise SystemExit(f"{which} left {len(left)} of {len(pids)} processes behind")
        return seconds

    return measure


FIGURES: dict[str, tuple[Callable[[Bench, str], float], float | None]] = {
    "--dump-params, 300 parameters, 5 includes": (dump, 0.8),
    f"{TALKERS} talkers, until all are heard": (first_messages, 1.0),
    f"Ctrl-C, {TALKERS} nodes": (ending("sleepers", TALKERS), None),
    f"Ctrl-C, {TALKERS} nodes that ignore it (0.5 s + 0.5 s)": (
        ending("stubborn", TALKERS, "--sigint-timeout=0.5", "--sigterm-timeout=0.5"),
        None,
    ),
    f"Ctrl-C, {MANY} nodes": (ending("many", MANY), None),
}


def main() -> None:
    rounds = int(sys.argv[1]) if sys.argv[1:] else 3
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder))
        print(
            f"{'seconds, median of ' + str(rounds):<56} {'rosz':>7} {'roslaunch':>9} {'ratio':>6}"
        )
        for title, (measure, most) in FIGURES.items():
            times: list[tuple[float, float]] = []
            for _ in range(rounds):
                seconds = measure(bench, "rosz")
                times.append((seconds, measure(bench, "ros") if bench.real else 0.0))
            ours, theirs = (statistics.median(column) for column in zip(*times, strict=True))
            line = f"{title:<56} {ours:>7.2f}"
            if bench.real:
                line += f" {theirs:>9.2f} {ours / theirs:>6.2f}"
            print(f"{line}{f'  (at most {most})' if most else ''}", flush=True)


if __name__ == "__main__":
    main()
