"""Replicas of an earlier build and of this one, in one domain over real links."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from network import eventually, free_port

from .fleet import ROOT, Cable, Fleet, Process, until_known, until_same

EARLIER = "7527a62b"
"""The last commit before the core of pure steps."""


@pytest.fixture(scope="module")
def earlier() -> Iterator[Path]:
    """A folder with the earlier build, and the program that its tests ran as a replica."""
    command = ["git", "-C", str(ROOT), "archive", EARLIER, "rosz", "tests/params/member.py"]
    try:
        archive = subprocess.run(command, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"commit {EARLIER} is not in this folder's history: {error}")
    with TemporaryDirectory(prefix="rosz") as folder:
        with tarfile.open(fileobj=BytesIO(archive)) as tar:
            tar.extractall(folder, filter="data")
        where = subprocess.run(
            [sys.executable, "-P", "-c", "import rosz; print(rosz.__file__)"],
            env={**os.environ, "PYTHONPATH": folder},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        assert where.startswith(folder), "the earlier build is not what such a process imports"
        yield Path(folder)


def all_get(processes: list[Process], name: str, value: object) -> None:
    """Check that a value which was acknowledged by all is there on all."""
    assert [process.do("get", name=name) for process in processes] == [value] * len(processes)


@pytest.mark.parametrize("first", ["earlier", "present"])
def test_builds_share_their_parameters(fleet: Fleet, earlier: Path, first: str) -> None:
    roots = [earlier, ROOT] if first == "earlier" else [ROOT, earlier]
    processes = [fleet.start(root=root) for root in (*roots, roots[0])]
    until_known(processes)
    for number, process in enumerate(processes):
        assert process.do("set", name="/turn", value=number)["slow"] == []
        all_get(processes, "/turn", number)
        values = {"x": number, "sub": {"y": [1, 2.5, "three"], "z": True}}
        assert process.do("load", namespace=f"/ns{number}", values=values)["slow"] == []
        all_get(processes, f"/ns{number}", values)
    for number, process in enumerate(processes):
        assert process.do("delete", name=f"/ns{(number + 1) % 3}/sub") == []
    for number in range(3):
        all_get(processes, f"/ns{number}", {"x": number})
    late = [fleet.start(root=root) for root in roots]
    for process in late:
        all_get([process], "/turn", 2)
        all_get([process], "/ns0", {"x": 0})
    until_known([*processes, *late])
    assert late[0].do("set", name="/late", value=1)["slow"] == []
    assert late[1].do("delete", name="/ns0") == []
    until_same([*processes, *late], "five replicas of two builds")


def test_builds_become_one_again_after_a_cut(fleet: Fleet, earlier: Path) -> None:
    port = free_port()
    cable = Cable(port)
    near = fleet.start(endpoint=f"tcp/127.0.0.1:{port}", mode="router", root=earlier)
    link = [f"tcp/127.0.0.1:{cable.port}"]
    far = fleet.start(endpoint=f"tcp/127.0.0.1:{free_port()}", mode="router", connect=link)
    until_known([near, far])
    assert near.do("set", name="/ns", value={"a": 1, "b": 2})["slow"] == []
    until_same([near, far], "before the cut")
    cable.cut()
    near.do("set", name="/ns/a", value="near", timeout=0.3)
    near.do("delete", name="/ns/b")
    far.do("set", name="/ns/a", value="far", timeout=0.3)
    far.do("set", name="/ns/c", value=3, timeout=0.3)
    cable.mend()
    until_known([near, far])
    until_same([near, far], "two builds after a cut")
    assert near.do("root")["ns"] == {"a": "far", "c": 3}
    cable.close()


def test_one_build_hands_over_to_the_other(fleet: Fleet, earlier: Path) -> None:
    present, before = fleet.start(), fleet.start(root=earlier)
    until_known([present, before])
    for number in range(20):
        present.do("set", name=f"/last/{number}", value=number, timeout=0)
    present.end()
    expected = {str(number): number for number in range(20)}
    eventually(lambda: before.do("get", name="/last") == expected, "the last writes")
