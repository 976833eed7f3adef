"""Launches of many nodes that come up and end, again and again.

``python -m tests.bench.scale.launches [--counts 20,100,200] [--runs 10]``: each node publishes a
topic and hears that of its neighbour. A run is right when all have heard it, the launch ends with
exit code 0 after Ctrl-C, nothing of it is left, and it reported no error.
"""

from __future__ import annotations

import os
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory

from ..figures import busy  # noqa: TID252  # tests is no package

ROOT = Path(__file__).parents[3]
NODE = f"""#!{sys.executable}
import sys
import rosz
from rosz.msgs.std_msgs.msg import String

number, count = int(sys.argv[1]), int(sys.argv[2])
with rosz.Node("node") as node:
    heard = []
    def hear(_):
        if not heard:
            heard.append(True)
            print("complete", flush=True)
    node.subscription(f"/t{{(number + 1) % count}}", String, hear)
    own = node.publisher(f"/t{{number}}", String)
    own.on_connection(lambda _: own.publish(String("here")))
    node.spin()
"""
PACKAGE = '<package format="2"><name>crowd</name><version>1.0.0</version></package>'
BAD = re.compile(rb"ERROR|WARN|Traceback|has died|escalating")


def launch_file(count: int) -> str:
    """Return a launch file of so many nodes."""
    nodes = "".join(
        f'<node name="s{number}" pkg="crowd" type="node.py" args="{number} {count}"'
        ' output="screen"/>\n'
        for number in range(count)
    )
    return f"<launch>\n{nodes}</launch>\n"


def write(folder: Path, count: int) -> Path:
    """Write a package with its launch file, and return the file."""
    (folder / "crowd").mkdir()
    (folder / "crowd/package.xml").write_text(PACKAGE)
    (folder / "crowd/node.py").write_text(NODE)
    (folder / "crowd/node.py").chmod(0o755)
    file = folder / "crowd/crowd.launch"
    file.write_text(launch_file(count))
    return file


class Run:
    """One launch.

    Args:
        file: The launch file.
        variables: Its environment.
    """

    def __init__(self, file: Path, variables: dict[str, str]) -> None:
        self.lines: list[bytes] = []
        self._complete = 0
        self._changed = threading.Condition()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "rosz", "launch", str(file)],
            env=variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with self._changed:
                self.lines.append(line)
                self._complete += b"complete\n" in line and b"..." not in line
                self._changed.notify()
        with self._changed:
            self._changed.notify()

    def wait(self, count: int, timeout: float) -> int:
        """Return how many nodes are complete when all are, or when the time is over."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._complete >= count or self._process.poll() is not None, timeout
            )
            return self._complete

    def end(self, timeout: float) -> int:
        """Press Ctrl-C, and return the exit code."""
        self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            return self._process.wait()
        finally:
            self._reader.join(timeout)


def left_over(mark: str) -> list[int]:
    """Return the processes whose environment has a text."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                if mark.encode() in (entry / "environ").read_bytes():
                    found.append(int(entry.name))
            except OSError:  # it has ended, or belongs to somebody else
                continue
    return found


def main() -> None:
    """Run each launch so many times, and print a row for each count."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--counts", default="20,100,200")
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--timeout", type=float, default=300.0, help="seconds for each step")
    given = parser.parse_args()
    print("| nodes | right | all heard, s: median; most | ended, s: median; most | |")
    print("|---|---|---|---|---|", flush=True)
    for count in map(int, given.counts.split(",")):
        up: list[float] = []
        down: list[float] = []
        problems: list[str] = []
        for turn in range(given.runs):
            with TemporaryDirectory(prefix="rosz-launches-") as folder:
                file = write(Path(folder), count)
                own = {
                    "ROS_PACKAGE_PATH": folder,
                    "HOME": folder,
                    "PYTHONPATH": str(ROOT),
                    "PATH": os.environ["PATH"],
                    "ROSZ_RENDEZVOUS": f"unixsock-stream/{folder}/z.sock",
                }
                began = time.monotonic()
                run = Run(file, own)
                complete = run.wait(count, given.timeout)
                up.append(time.monotonic() - began)
                began = time.monotonic()
                code = run.end(given.timeout)
                down.append(time.monotonic() - began)
                bad = [line for line in run.lines if BAD.search(line)]
                left = left_over(folder)
                if complete < count or code or bad or left:
                    problems.append(
                        f"run {turn + 1}: {complete} heard, exit code {code}, left {left},"
                        f" {len(bad)} bad lines: {b''.join(bad[:3]).decode(errors='replace')!r}"
                    )
        figures = (f"{statistics.median(one):.3g}; {max(one):.3g}" for one in (up, down))
        right = f"{given.runs - len(problems)} of {given.runs}"
        print(f"| {count} | {right} | {' | '.join(figures)} | {'; '.join(problems)} |", flush=True)
    print(busy(), file=sys.stderr)


if __name__ == "__main__":
    main()
