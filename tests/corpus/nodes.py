"""Compares what becomes of a package's Python nodes on rospy and on rosz."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from oracle import PYTHON

from rosz.packages import is_python

from .devel import Devel
from .packages import Corpus, Package, Repository
from .third_party import link

__all__ = ("Nodes",)

_STAGE = Path(__file__).with_name("stage.py")
_ROS = re.compile(r"\brospy\b|\bactionlib\b|\brosbag\b|\bsmach\b|\btf2?(?:_ros)?\b.*import|roslib")
_FRAME = re.compile(r'File "([^"]+)", line (\d+), in ')
_RAISED = re.compile(r"^(?:[\w.]+\.)?([A-Za-z_]\w*)(?:: (.*))?$")
_MODULE = re.compile(r"No module named '?([\w.]+)'?|cannot import name '?(\w+)'?")
_NUMBERS = re.compile(r"_\d+_\d{6,}")
_SYNTAX = frozenset({"IndentationError", "SyntaxError", "TabError"})
_SKIPPED = frozenset({"test", "tests", "setup.py", "doc", "docs", "ci", ".ci", "cfg"})
_OWN = re.compile(
    r"/(rosout\w*|clock|parameter_events|.*/(get_loggers|set_logger_level|get_type_description)"
    r"|.*/(describe|get|list|set)_parameter\w*|rosdistro|rosversion|run_id|roslaunch/.*"
    r"|.*/_action/\w+)$"
)
_ALIASES = {"tf/tfMessage": "tf2_msgs/TFMessage"}
"""Names of one type, with one md5, of which rosz has one class."""
_SETUPS = {
    re.compile(r"'PyKDL\.\w+' object has no attribute"): (
        "Debian's PyKDL takes no new attributes, as Noetic's does"
    ),
}
"""What ROS 1 says where its set-up here is not that of a ROS 1 user, and what differs."""
_PATH = "/usr/bin:/bin:/usr/sbin:/sbin"
_ROSPACK = f"""\
#!{PYTHON}
import sys
import rospkg
print(rospkg.RosPack().get_path(sys.argv[2]))
"""
_QUIET, _LONGEST = 2.5, 30.0
_LATER = 12.0, 60.0
"""For nodes whose outcomes differ: what they do after a while, and on a busy machine."""


class Node(NamedTuple):
    """A program of a package."""

    repository: Repository
    package: Package
    path: Path

    @property
    def case(self) -> str:
        """What stands for it in results."""
        return f"{self.repository.name}:{self.package.name}/{self.path.name}"


class Nodes:
    """The nodes of a corpus.

    Args:
        corpus: The repositories.
        devel: What ROS 1 imports.
        folder: Where the outcomes on ROS 1 are kept, as they stay the same.
        limit: How many nodes of a repository are run at most, spread over its packages.
    """

    def __init__(self, corpus: Corpus, devel: Devel, folder: Path, limit: int) -> None:
        self._corpus, self._devel, self._limit = corpus, devel, limit
        self._kept = folder / "ros1"
        self._kept.mkdir(parents=True, exist_ok=True)
        self._environ = _rosz_environment(link(folder / "third_party"))
        self._programs = _real_programs(folder / "programs")

    def compare(
        self, repositories: list[Repository], words: list[str], jobs: int
    ) -> Iterator[dict[str, Any]]:
        """Yield a row for each node, both outcomes in it, one of each repository at first.

        Args:
            repositories: Those whose nodes are run.
            words: Only nodes whose case contains one of these; all when empty.
            jobs: How many at a time.
        """
        turns = zip_longest(*map(self._find, repositories))
        found = [
            node
            for turn in turns
            for node in turn
            if node and (not words or any(word in node.case for word in words))
        ]
        with ThreadPoolExecutor(jobs) as pool:
            yield from pool.map(self._row, found)

    def _find(self, repository: Repository) -> Iterator[Node]:
        queues = [list(_programs(repository, one)) for one in repository.packages.values()]
        count = 0
        while any(queues):
            for queue in filter(None, queues):
                if count == self._limit:
                    return
                count += 1
                yield queue.pop(0)

    def _row(self, node: Node) -> dict[str, Any]:
        real = self._on_ros1(node)
        ours = self._on_rosz(node)
        if not _same(ours, real):  # one of them may have been seen earlier than the other
            ours = self._on_rosz(node, again=True)
        if not _same(ours, real):
            real = self._on_ros1(node, again=True)
        row: dict[str, Any] = {
            "case": node.case,
            "file": str(node.path),
            "rosz": ours,
            "ros1": real,
        }
        row["python2"] = real["outcome"][1:2] in [[name] for name in _SYNTAX]
        row["equal"] = _same(ours, real)
        row["setup"] = "" if row["equal"] else _setup(real)
        mark = "equal" if row["equal"] else "python 2" if row["python2"] else "DIFFERS"
        mark = "set-up" if row["setup"] else mark
        print(
            f"{mark} {node.case}: {ours['outcome']} {real['outcome']}", file=sys.stderr, flush=True
        )
        return row

    def _on_ros1(self, node: Node, *, again: bool = False) -> dict[str, Any]:
        text = node.path.read_bytes()
        kept = self._kept / (hashlib.sha256(f"{node.case}".encode() + text).hexdigest() + ".json")
        if kept.exists() and (not again or json.loads(kept.read_text()).get("again")):
            done: dict[str, Any] = json.loads(kept.read_text())
            return done
        environ = {
            "PATH": f"{self._programs}:{_PATH}",
            "PYTHONPATH": self._devel.python_path(node.repository),
            "ROS_PACKAGE_PATH": self._corpus.path(node.repository, real=True),
            "ROS_MASTER_URI": "http://127.0.0.1:11311",
            "ROS_ROOT": "/usr/share/ros",
            "ROS_DISTRO": "noetic",
        }
        job = {
            "real": True,
            "core": ["/usr/bin/rosmaster", "--core", "-p", "11311"],
            "ready": [PYTHON, "-c", "import socket;socket.create_connection(('127.0.0.1',11311))"],
            "node": [PYTHON, str(node.path)],
        }
        found = self._run(job, environ, node, again=again)
        found["again"] = again
        if found["outcome"][0] != "stage":
            kept.write_text(json.dumps(found))
        return found

    def _on_rosz(self, node: Node, *, again: bool = False) -> dict[str, Any]:
        environ = {
            **self._environ,
            "ROS_PACKAGE_PATH": self._corpus.path(node.repository, real=False),
            "ROSZ_RENDEZVOUS": "tcp/127.0.0.1:7447",
            "ROS_DOMAIN_ID": "0",
        }
        rosz = [sys.executable, "-P", "-m", "rosz"]
        job = {
            "real": False,
            "rosz": rosz,
            "core": [*rosz, "core"],
            "ready": [*rosz, "param", "list"],
            "node": [*rosz, "run", node.package.name, node.path.name],
        }
        return self._run(job, environ, node, again=again)

    def _run(
        self, job: dict[str, Any], environ: dict[str, str], node: Node, *, again: bool
    ) -> dict[str, Any]:
        with (
            tempfile.TemporaryDirectory(prefix="rosz-corpus-") as home,
            tempfile.TemporaryDirectory() as spare,
        ):
            Path(home).chmod(0o755)
            variables = {
                "PATH": _PATH,
                "HOME": home,
                "ROS_HOME": home,
                "ROS_IP": "127.0.0.1",
                "LANG": "C.UTF-8",
                "PYTHONUNBUFFERED": "1",
                "PYTHONDONTWRITEBYTECODE": "1",
                **environ,
            }
            quiet, longest = _LATER if again else (_QUIET, _LONGEST)
            limits = {"quiet": quiet, "longest": longest, "spare": spare}
            namespaces = ["--net", "--pid", "--ipc", "--fork", "--mount-proc", "--kill-child"]
            done = subprocess.run(
                ["unshare", *namespaces, sys.executable, "-P", str(_STAGE)],
                input=json.dumps({**job, **limits, "environ": variables}),
                capture_output=True,
                text=True,
                check=False,
                timeout=600,
            )
        if done.returncode:
            return {"outcome": ["stage", done.stderr[-500:]], "stderr": done.stderr[-2000:]}
        report = json.loads(done.stdout)
        return _normal(report, node)


def _rosz_environment(third_party: Path) -> dict[str, str]:
    """Return what a shell has that evaluated ``rosz env``."""
    own = {"PATH": f"{Path(sys.executable).parent}:{_PATH}", "PYTHONPATH": str(third_party)}
    done = subprocess.run(
        ["/bin/bash", "-c", 'eval "$(rosz env bash)"; env -0'],
        env=own,
        capture_output=True,
        text=True,
        check=True,
    )
    found = dict(line.partition("=")[::2] for line in done.stdout.split("\0") if line)
    return {name: found[name] for name in (*own, "ROSZ_PYTHON")}


def _real_programs(folder: Path) -> Path:
    """Write rospack, which Debian does not have without C++; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rospack").write_text(_ROSPACK)
    (folder / "rospack").chmod(0o755)
    return folder


def _programs(repository: Repository, package: Package) -> Iterator[Node]:
    """Yield the executable scripts of a package that use ROS."""
    for path in sorted(package.path.rglob("*")):
        skipped = _SKIPPED & set(path.relative_to(package.path).parts) or path.suffix == ".cfg"
        if skipped or path.name.startswith("test_") or path.is_symlink() or not path.is_file():
            continue
        executable = os.access(path, os.X_OK) and is_python(path)
        if executable and _ROS.search(path.read_text("utf-8", "replace")):
            yield Node(repository, package, path)


def _normal(report: dict[str, Any], node: Node) -> dict[str, Any]:
    """Return what two runs of a node have in common."""
    code = report["code"]
    outcome = ["ran"] if code is None else _ending(code, report["stderr"], node)
    found: dict[str, Any] = {"outcome": outcome, "stderr": report["stderr"][-3000:]}
    found["stdout"] = report["stdout"][-1000:]
    for kind in ("publishers", "subscribers"):
        found[kind] = {
            _NUMBERS.sub("_N", name): _ALIASES.get(type_name, type_name)
            for name, type_name in sorted(report[kind].items())
            if not _OWN.match(name)
        }
    for kind in ("services", "parameters"):
        names = {_NUMBERS.sub("_N", name) for name in report[kind]}
        found[kind] = sorted(name for name in names if not _OWN.match(name))
    return found


def _ending(code: int, stderr: str, node: Node) -> list[Any]:
    """Return the exit code, and the exception that ended a program with its last own frame."""
    lines = [line for line in stderr.splitlines() if line.strip()]
    if code and lines and (match := _RAISED.match(lines[-1])) and match[1] in _SYNTAX:
        return ["raised", match[1], ""]
    marks = [n for n, line in enumerate(lines) if line.startswith("Traceback (most recent")]
    if not code or not marks:
        return ["ended", code]
    frame, raised = "", ""
    for line in lines[marks[-1] + 1 :]:
        place = _FRAME.search(line)
        if place:
            if place[1].startswith(str(node.repository.path)):
                frame = f"{Path(place[1]).name}:{place[2]}"
        elif not line.startswith(" ") and (match := _RAISED.match(line)) and not raised:
            raised = match[1]
            missing = _MODULE.search(match[2] or "")
            if missing:
                raised += f" {missing[1] or missing[2]}"
    return ["raised", raised, frame]


def _setup(real: dict[str, Any]) -> str:
    """Return how ROS 1 as it is installed here differs from what its users have; or nothing."""
    said = real["stderr"] + real.get("stdout", "")
    return next((reason for pattern, reason in _SETUPS.items() if pattern.search(said)), "")


def _same(ours: dict[str, Any], real: dict[str, Any]) -> bool:
    return not differences(ours, real)


def differences(ours: dict[str, Any], real: dict[str, Any]) -> list[str]:
    """Return in words where two outcomes differ; what a node that ended registered is gone."""
    if ours["outcome"] != real["outcome"]:
        return [f"outcome: rosz {ours['outcome']}, ROS 1 {real['outcome']}"]
    if real["outcome"][0] == "stage":
        return ["not run"]
    kinds = ["parameters"]
    if real["outcome"] == ["ran"]:
        kinds = ["publishers", "subscribers", "services", "parameters"]
    found = []
    for kind in kinds:
        mine, other = ours[kind], real[kind]
        if kind in {"publishers", "subscribers"}:
            other = {name: mine.get(name, t) if t == "*" else t for name, t in other.items()}
        if mine != other:
            found.append(f"{kind}: rosz {mine}, ROS 1 {other}")
    return found
