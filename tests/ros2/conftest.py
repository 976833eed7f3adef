"""A world of nodes that tests of ``ros2`` share, and the command itself as a process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from network import TIMEOUT, Network, Program

RECORDED = json.loads((Path(__file__).parent / "recorded.json").read_text())
_SETUP = """from setuptools import setup
setup(name="demo_nodes_py", entry_points={{"console_scripts": {scripts}}})
"""


class Done(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str


class Ros2:
    """Runs ``ros2`` in a folder with a workspace."""

    def __init__(self, network: Network) -> None:
        self.network = network

    def command(self, *words: str) -> list[str]:
        return [sys.executable, "-P", "-m", "rosz", "ros2", *words]

    def __call__(self, *words: str, text: str = "") -> Done:
        done = subprocess.run(
            self.command(*words),
            env=self.network.variables(),
            cwd=self.network.folder,
            input=text,
            capture_output=True,
            text=True,
            timeout=4 * TIMEOUT,
            check=False,
        )
        return Done(done.returncode, done.stdout, done.stderr)

    def start(self, *words: str) -> Program:
        program = Program(self.command(*words), self.network.variables(), self.network.folder)
        self.network._open.append(program)
        return program


def _make_package(folder: Path, name: str, scripts: list[str]) -> None:
    """Make a package in Python whose programs do nothing."""
    package = folder / "src" / name
    (package / name).mkdir(parents=True)
    (package / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (package / name / "main.py").write_text("def main():\n    print('hi', flush=True)\n")
    entries = [f"{script} = {name}.main:main" for script in scripts]
    (package / "setup.py").write_text(_SETUP.format(scripts=entries))


@pytest.fixture(scope="module")
def world() -> Iterator[Ros2]:
    """The nodes of the recording, run by rosz's rclpy, on a network of this module."""
    network = Network(domain=43)
    lines = {row["line"]: row for row in RECORDED["lines"]}
    listed = lines["ros2 pkg executables demo_nodes_py"]["stdout"].split()
    _make_package(network.folder, "demo_nodes_py", listed[1::2])
    script = network.folder / "world.py"
    text = RECORDED["world"]
    script.write_text(text.replace("\ne.spin()", "\nprint('ready', flush=True)\ne.spin()"))
    try:
        network.run("-m", "rosz.script", str(script)).wait_for("ready")
        yield Ros2(network)
    finally:
        network.close()


@pytest.fixture
def ros2(network: Network) -> Ros2:
    """The command on a network of the test, where nobody is."""
    return Ros2(network)
