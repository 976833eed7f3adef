"""Run one node and report on it; `nodes` starts this as root, in namespaces of its own.

The node runs as a user that may write nothing but its home, with the loopback interface and nothing
else of the network. It has started when its threads wait nearly all the time.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import deque
from pathlib import Path
from pwd import getpwuid
from typing import Any

__all__ = ("main",)

_NOBODY = 65534
_LOOK = 0.25
_SHARE = 20
"""Ticks of a second; of a hundred."""
_WAITING = 0.6


def _show_python(base: Path, home: Path, spare: Path) -> None:
    """Make the interpreter readable for all, where it lies in the home of this user."""
    if not base.is_relative_to(home):
        return
    steps = (
        ["mount", "--bind", str(base), str(spare)],
        ["mount", "-t", "tmpfs", "-o", "mode=755", "none", str(home)],
        ["mkdir", "-p", str(base)],
        ["mount", "--bind", str(spare), str(base)],
    )
    for step in steps:
        subprocess.run(step, check=True)


def _used(pids: list[int]) -> tuple[int, bool]:
    """Return the ticks that processes have computed, and whether all their threads wait."""
    ticks, waiting = 0, True
    for pid in pids:
        try:
            own = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            ticks += int(own[11]) + int(own[12])
            for stat in Path(f"/proc/{pid}/task").glob("*/stat"):
                waiting &= stat.read_text().rpartition(")")[2].split()[0] == "S"
        except OSError:
            waiting = False
    return ticks, waiting


def _pids() -> list[int]:
    """Return the processes of the node's user."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if folder.stat().st_uid == _NOBODY:
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def _watch(node: subprocess.Popen[bytes], job: dict[str, Any]) -> int | None:
    """Wait until the node has started or ended; return its exit code."""
    begin = time.monotonic()
    looks: deque[tuple[float, int, bool]] = deque()
    while time.monotonic() - begin < job["longest"]:
        code = node.poll()
        if code is not None:
            return code
        looks.append((time.monotonic(), *_used(_pids())))
        seconds, ticks = looks[-1][0] - looks[0][0], looks[-1][1] - looks[0][1]
        if seconds > job["quiet"]:
            # A node that polls or publishes computes a little all the time.
            waiting = sum(look[2] for look in looks) / len(looks)
            if ticks < _SHARE * seconds and waiting > _WAITING:
                return None
            looks.popleft()
        time.sleep(_LOOK)
    return node.poll()


def _ros1(job: dict[str, Any]) -> dict[str, Any]:
    from xmlrpc.client import ServerProxy

    master: Any = ServerProxy(job["environ"]["ROS_MASTER_URI"])
    publishers, subscribers, services = master.getSystemState("/corpus")[2]
    types = dict(master.getTopicTypes("/corpus")[2])
    return {
        "publishers": {name: types.get(name, "*") for name, _ in publishers},
        "subscribers": {name: types.get(name, "*") for name, _ in subscribers},
        "services": sorted(name for name, _ in services),
        "parameters": master.getParamNames("/corpus")[2],
    }


def _rosz(job: dict[str, Any]) -> dict[str, Any]:
    def said(*words: str) -> str:
        return subprocess.run(
            [*job["rosz"], *words], env=job["environ"], capture_output=True, text=True, check=False
        ).stdout

    infos = []
    names = [one["name"] for one in json.loads(said("node", "list", "--json") or "[]")]
    if names:
        infos = json.loads(said("node", "info", "--quiet", "--json", *names) or "[]")
    return {
        "publishers": {one["name"]: one["type"] for info in infos for one in info["publications"]},
        "subscribers": {
            one["name"]: one["type"] for info in infos for one in info["subscriptions"]
        },
        "services": sorted({one["name"] for info in infos for one in info["services"]}),
        "parameters": said("param", "list").split(),
    }


def main() -> None:
    """Read the job from stdin, and write the report to stdout."""
    job = json.load(sys.stdin)
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    environ, home = job["environ"], job["environ"]["HOME"]
    os.chown(home, _NOBODY, _NOBODY)
    _show_python(Path(sys.base_prefix), Path(getpwuid(os.getuid()).pw_dir), Path(job["spare"]))
    with Path(home, "core.log").open("wb") as log:
        core = subprocess.Popen(job["core"], env=environ, stdout=log, stderr=log, cwd=home)
        begin = time.monotonic()
        while subprocess.run(
            job["ready"], env=environ, check=False, capture_output=True
        ).returncode:
            if core.poll() is not None or time.monotonic() - begin > 90:
                sys.exit("no core: " + Path(home, "core.log").read_text())
            time.sleep(_LOOK)
    out, err = Path(home, "out"), Path(home, "err")
    with out.open("wb") as stdout, err.open("wb") as stderr:
        node = subprocess.Popen(
            job["node"],
            env=environ,
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
            cwd=home,
            user=_NOBODY,
            group=_NOBODY,
            extra_groups=[],
            start_new_session=True,
        )
        code = _watch(node, job)
    found = {
        "code": code,
        "stdout": out.read_bytes()[-4000:].decode("utf-8", "replace"),
        "stderr": err.read_bytes()[-8000:].decode("utf-8", "replace"),
        **(_ros1 if job["real"] else _rosz)(job),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
