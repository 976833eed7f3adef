"""Memory of processes that stay while nodes come and go: ``python -m tests.bench.soak``.

A core and a node stay; nodes with sessions of their own come and go, one each second by default.
A line a minute shows the memory of both (RSS), their threads and open files, and how many objects
of Python the node holds. At the end stand what was added for each node that came and went, and the
growth in the second half. With ``--bare`` a router of Zenoh alone stands in the place of the core:
its growth is the share of Zenoh. ``python -m tests.upstream.memory`` shows that of a peer.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from pathlib import Path
from typing import NamedTuple

from ..figures import busy  # noqa: TID252  # tests is no package

WORKER = Path(__file__).with_name("worker.py")
FLAT = 5
"""Percent that memory may grow in the second half."""


class Usage(NamedTuple):
    """What a process uses: memory in kB, threads, and open files."""

    memory: int
    threads: int
    files: int


class Sight(NamedTuple):
    """What was seen at one moment: nodes so far, what each process uses, and objects of Python."""

    nodes: int
    core: Usage
    node: Usage
    objects: int


class Part:
    """A process of the soak.

    Args:
        argv: Arguments of Python.
        variables: Environment.
    """

    def __init__(self, argv: list[str], variables: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *argv],
            env=variables,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.stdin, self.stdout = self.process.stdin, self.process.stdout

    def line(self) -> str:
        """Return the next line that it writes."""
        line = self.stdout.readline()
        if not line:
            raise SystemExit(f"{self.process.args!r} ended with {self.process.wait()}")
        return line.strip()

    def ask(self) -> str:
        """Return its answer to a line."""
        self.stdin.write("\n")
        self.stdin.flush()
        return self.line()

    def usage(self) -> Usage:
        """Return what it uses now."""
        folder = Path(f"/proc/{self.process.pid}")
        status = (folder / "status").read_text()
        memory, threads = (
            int(status.partition(f"{name}:")[2].split()[0]) for name in ("VmRSS", "Threads")
        )
        return Usage(memory, threads, len(list((folder / "fd").iterdir())))

    def close(self) -> None:
        """End it."""
        self.stdin.close()
        self.process.terminate()
        self.process.wait()


def options() -> Namespace:
    """Read the command line."""
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--per-second", type=float, default=1.0, help="nodes that come and go")
    parser.add_argument("--bare", action="store_true", help="a router of Zenoh alone as core")
    parser.add_argument("--every", type=float, default=60.0, help="seconds between two lines")
    return parser.parse_args()


def watch(given: Namespace, variables: dict[str, str]) -> list[Sight]:
    """Let nodes come and go, and print and return what was seen meanwhile."""
    bare = [str(WORKER), "router", variables["ROSZ_RENDEZVOUS"]]
    core = Part(bare if given.bare else ["-m", "rosz", "core"], variables)
    parts = [core]
    try:
        core.line()
        node = Part([str(WORKER), "stay"], variables)
        parts.append(node)
        node.line()
        comes = Part([str(WORKER), "come", str(given.per_second)], variables)
        parts.append(comes)
        sights: list[Sight] = []
        began = due = time.monotonic()
        while time.monotonic() < began + given.minutes * 60:
            count = int(comes.line())
            if time.monotonic() < due:
                continue
            due += given.every
            sights.append(Sight(count, core.usage(), node.usage(), int(node.ask())))
            figures = (count, *sights[-1].core, *sights[-1].node, sights[-1].objects)
            print(f"| {(time.monotonic() - began) / 60:.1f} |", end="")
            print("".join(f" {figure} |" for figure in figures), flush=True)
        return sights
    finally:
        for part in reversed(parts):
            part.close()


def main() -> None:
    """Print a table, and whether memory is flat."""
    given = options()
    print(f"{busy()}\n", file=sys.stderr)
    process = "threads | files"
    print(f"| minute | nodes so far | core, kB | {process} | node, kB | {process} | objects |")
    print(f"|{'---|' * 9}")
    with tempfile.TemporaryDirectory(prefix="rosz-") as folder:
        own = {"HOME": folder, "ROSZ_RENDEZVOUS": f"unixsock-stream/{folder}/z.sock"}
        root = str(Path(__file__).parents[3])
        sights = watch(given, {**os.environ, **own, "ROS_DOMAIN_ID": "47", "PYTHONPATH": root})
    if len(sights) < 3:  # two halves
        raise SystemExit("too short to tell")
    middle, last = sights[len(sights) // 2], sights[-1]
    nodes = max(1, last.nodes - middle.nodes)
    for name in ("core", "node"):
        before, after = getattr(middle, name).memory, getattr(last, name).memory
        growth = 100 * (after - before) / before
        flat = "flat" if growth <= FLAT else "grows"
        print(
            f"{name}: {growth:+.1f} % in the second half ({flat}),"
            f" {(after - before) / nodes:.2f} kB for each node"
        )


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
