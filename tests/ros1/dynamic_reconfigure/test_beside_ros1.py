"""Programs and dynparam, on Debian's dynamic_reconfigure with a roscore and here: the same."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest
from network import Network, Program, eventually, free_port
from oracle import PYTHON, require

from .cfg_samples import write_package

pytestmark = [pytest.mark.ros1]

PROGRAMS = Path(__file__).with_name("programs")
_PROGRAM_SAYS = re.compile(r"\[\(|/|serving|end")
"""Lines of the server itself: what the libraries log of a fault is theirs."""

_LONGEST = 60
"""Seconds for one command; ROS 1's take one each where nothing else runs."""

NAME = "dynamic_tutorials"
DYNPARAM = Path("/usr/lib/dynamic_reconfigure/dynparam")


class Side:
    """One of the two: where programs run.

    Args:
        python: What runs a program.
        dynparam: What runs dynparam.
        variables: The environment.
        clean: Takes parameters away that programs have left.
    """

    def __init__(
        self,
        python: Sequence[str],
        dynparam: Sequence[str],
        variables: dict[str, str],
        clean: Callable[[], object] = bool,
    ) -> None:
        self.clean = clean
        self._python = tuple(python)
        self._dynparam = tuple(dynparam)
        self._variables = variables

    def start(self, program: str, *words: str) -> Program:
        """Start a program."""
        return Program([*self._python, str(PROGRAMS / program), *words], self._variables)

    def run(self, program: str) -> str:
        """Run a program to its end, and return what it prints."""
        done = self._run([*self._python, str(PROGRAMS / program)])
        assert done.returncode == 0, done.stderr
        return done.stdout

    def dynparam(self, *words: str) -> str:
        """Run dynparam to its end, and return what it prints."""
        return self._run([*self._dynparam, *words]).stdout

    def _run(self, command: list[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command,
            env=self._variables,
            capture_output=True,
            text=True,
            timeout=_LONGEST,
            check=False,
        )


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package of ours, and what ROS 1 generates from it."""
    folder = tmp_path_factory.mktemp("beside")
    write_package(folder / "src" / "sample")
    return folder


@pytest.fixture(scope="module")
def ros(workspace: Path) -> Iterator[Side]:
    modules = ("dynamic_reconfigure", "rospy", "roslaunch")
    require(*modules, package="ros-base, python3-dynamic-reconfigure")
    port = free_port()
    generated = workspace / "generated"
    variables = {
        "PATH": "/usr/bin:/bin",
        "HOME": str(workspace),
        "ROS_HOME": str(workspace),
        "ROS_IP": "127.0.0.1",
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_PACKAGE_PATH": str(generated),
        "PYTHONPATH": str(generated),
        "PYTHONUNBUFFERED": "1",
        "LANG": "C.UTF-8",
    }
    files = sorted(map(str, (workspace / "src" / "sample" / "cfg").glob("*.cfg")))
    subprocess.run(
        [PYTHON, "-W", "ignore", str(Path(__file__).with_name("reconfigure_worker.py"))],
        input=json.dumps({"files": files, "folder": str(generated), "changes": {}}),
        env=variables,
        text=True,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    core = subprocess.Popen(
        ["/usr/bin/roscore", "-p", str(port)],
        env=variables,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        eventually(lambda: _answers(variables["ROS_MASTER_URI"]), "roscore")
        clean = partial(_forget, variables["ROS_MASTER_URI"])
        yield Side([PYTHON], [PYTHON, str(DYNPARAM)], variables, clean)
    finally:
        os.killpg(core.pid, signal.SIGINT)
        try:
            core.wait(60)
        except subprocess.TimeoutExpired:
            os.killpg(core.pid, signal.SIGKILL)
            core.wait()


def _answers(uri: str) -> bool:
    with ServerProxy(uri) as master:
        try:
            answer = master.lookupNode("/test", "/rosout")
        except OSError:
            return False
    return isinstance(answer, list) and answer[0] == 1


def _forget(uri: str) -> None:
    with ServerProxy(uri) as master:
        master.deleteParam("/test", f"/{NAME}")


@pytest.fixture
def rosz(network: Network, workspace: Path) -> Side:
    variables = network.variables(ROSZ_PACKAGE_PATH=str(workspace / "src"), LANG="C.UTF-8")
    python = [sys.executable, "-P", "-m"]
    return Side(
        [*python, "rosz.ros1"],
        [*python, "rosz", "run", "dynamic_reconfigure", "dynparam"],
        variables,
    )


def _play(side: Side, config: str, steps: Sequence[Sequence[str]]) -> list[str]:
    """Serve a configuration, run programs and dynparam, and return the lines that all print."""
    side.clean()
    server = side.start("server.py", config)
    printed: list[str] = []
    try:
        server.wait_for("serving", _LONGEST)
        for program, *words in steps:
            done = side.dynparam(*words) if program == "dynparam" else side.run(program)
            printed += [f"$ {program} {' '.join(words)}", *done.splitlines()]
        server.send(signal.SIGINT)
        assert server.exit_code(_LONGEST) == 0
    finally:
        server.close()
    return [*printed, *filter(_PROGRAM_SAYS.match, server.lines)]


def _both(
    ours: tuple[Side, Sequence[Sequence[str]]],
    theirs: tuple[Side, Sequence[Sequence[str]]],
    config: str = "Tutorials",
) -> tuple[list[str], list[str]]:
    """Play on both sides at once."""
    with ThreadPoolExecutor(2) as pool:
        first, second = (pool.submit(_play, side, config, steps) for side, steps in (ours, theirs))
        return first.result(), second.result()


def test_the_tutorial(ros: Side, rosz: Side) -> None:
    steps = [["client.py"]]
    ours, theirs = _both((rosz, steps), (ros, steps))
    assert ours == theirs


def test_groups(ros: Side, rosz: Side) -> None:
    steps = [["groups.py"]]
    ours, theirs = _both((rosz, steps), (ros, steps), "Groups")
    assert ours == theirs


def test_dynparam(ros: Side, rosz: Side, tmp_path: Path) -> None:
    saved = tmp_path / "saved.yaml"
    saved.write_text("int_param: 21\nbool_param: false\n---\nint_param: 22\n")
    steps = [
        ["dynparam", "list"],
        ["dynparam", "set", NAME, "int_param", "-3"],
        ["dynparam", "set", NAME, "str_param", "007"],
        ["dynparam", "set", "--timeout=60", NAME, "{int_param: 4, size: Large}"],
        ["dynparam", "load", NAME, str(saved)],
        ["dynparam", "set_from_parameters", NAME, "_double_param:=0.5", "_str_param:=from here"],
        ["dynparam", "get", NAME],
    ]
    ours, theirs = _both((rosz, steps), (ros, steps))
    assert ours == theirs


def test_files_go_both_ways(ros: Side, rosz: Side, tmp_path: Path) -> None:
    """What each dumps, the other loads."""
    one, other = str(tmp_path / "one.yaml"), str(tmp_path / "other.yaml")
    dump = [["dynparam", "set", NAME, "int_param", "77"], ["dynparam", "dump", NAME]]
    load = [["dynparam", "load", NAME], ["dynparam", "get", NAME]]
    _both(
        (rosz, [dump[0], [*dump[1], one]]),
        (ros, [dump[0], [*dump[1], other]]),
    )
    ours, theirs = _both((rosz, [[*load[0], other], load[1]]), (ros, [[*load[0], one], load[1]]))
    assert ours[1:] == theirs[1:]
    assert "'int_param': 77" in ours[2]
