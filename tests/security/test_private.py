"""``ROSZ_RENDEZVOUS=private``: two users of one machine, who do not reach each other."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from hosts.host import Host, HostProgram
from hosts.world import World
from network import eventually

import rosz
from rosz.environment import Environment
from rosz.errors import UsageError

CONNECT = """
import socket, sys
for path in sys.argv[1:]:
    with socket.socket(socket.AF_UNIX) as probe:
        try:
            probe.connect(path)
            print("connected to", path)
        except OSError as error:
            print(type(error).__name__)
"""
TUTORIALS = Path(rosz.__path__[0], "share/rosz_tutorials/scripts")


class User:
    """A user of a machine, other than root.

    Args:
        host: The machine.
        number: The id of the user.
    """

    def __init__(self, host: Host, number: int) -> None:
        self._host = host
        ids = ("--reuid", str(number), "--regid", str(number))
        self._prefix = ("setpriv", "--clear-groups", *ids, sys.executable)
        self.home = f"/run/user/{number}"
        host.run("install", "-d", "-m", "0700", "-o", str(number), "-g", str(number), self.home)

    def start(self, *argv: str, **variables: str) -> HostProgram:
        settings = {"HOME": self.home, "ROSZ_RENDEZVOUS": "private", **variables}
        return self._host.execute(*self._prefix, *argv, **settings)

    def rosz(self, *argv: str, **variables: str) -> HostProgram:
        return self.start("-m", "rosz", *argv, **variables)

    def node(self, script: str) -> HostProgram:
        """Start a node without executing Python once more, which may be in root's home."""
        return self.start("-m", "rosz.script", str(TUTORIALS / script))

    def ask(self, *argv: str) -> str:
        program = self.rosz(*argv)
        assert program.exit_code() == 0, program.output
        return program.output


@pytest.fixture
def users(world: World) -> tuple[Host, User, User]:
    robot = world.host("robot")
    owner, other = User(robot, 4001), User(robot, 4002)
    if owner.start("-c", "import rosz").exit_code():
        pytest.skip("other users cannot run this Python")
    return robot, owner, other


def test_another_user_reaches_nothing(users: tuple[Host, User, User]) -> None:
    robot, owner, other = users
    core = owner.rosz("core")
    core.wait_for("listening on unixsock-stream//run/user/4001/rosz/z.sock")
    core.wait_for("started core")
    node = owner.node("publisher.py")
    owner.ask("param", "set", "/pin", "vault-4711")
    eventually(lambda: owner.ask("node", "list") == "/publisher", "the node")
    sockets = robot.run("find", owner.home, "-type", "s").split()
    assert len(sockets) >= 2  # of the core and of the node
    # No port is open to anybody, on the loopback either.
    assert robot.run("ss", "-Hlntu") == ""
    tried = other.start("-c", CONNECT, *sockets)
    assert tried.exit_code() == 0
    assert tried.output.split() == ["PermissionError"] * len(sockets)
    its_place = f"unixsock-stream/{owner.home}/rosz/z.sock"
    for command in (
        ("param", "get", "/pin"),
        ("node", "kill", "/publisher"),
        ("topic", "list"),
    ):
        places = (its_place, "private", "")  # at the same time, as each waits for a while
        for program in [other.rosz(*command, ROSZ_RENDEZVOUS=place) for place in places]:
            assert program.exit_code() == 1, program.output
            assert "vault-4711" not in program.output
            assert "chatter" not in program.output
    assert owner.ask("node", "list") == "/publisher"
    assert node.process.poll() is None


def test_nodes_meet_without_a_core(users: tuple[Host, User, User]) -> None:
    """Nodes of one user form a mesh of unix sockets; those of another one form their own."""
    robot, owner, other = users
    for user in (owner, other):
        user.node("publisher.py")
        user.node("subscriber.py").wait_for("I heard")
    assert robot.run("ss", "-Hlntu") == ""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that is to be private."""
    monkeypatch.setattr("rosz.environment._USER_FOLDERS", tmp_path)
    (tmp_path / str(os.geteuid())).mkdir()
    return tmp_path / str(os.geteuid()) / "rosz"


def test_the_folder_is_made_private(folder: Path) -> None:
    for _ in range(2):
        found = Environment.read({"ROSZ_RENDEZVOUS": "private"}).rendezvous
        assert found == f"unixsock-stream/{folder}/z.sock"
        assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("kind", ["open", "link", "file"])
def test_a_folder_that_others_may_enter_is_refused(folder: Path, kind: str) -> None:
    if kind == "open":
        folder.mkdir(mode=0o755)
    elif kind == "link":
        (folder.parent / "elsewhere").mkdir(mode=0o700)
        folder.symlink_to("elsewhere")
    else:
        folder.touch(mode=0o600)
    with pytest.raises(UsageError, match=r"is not a folder that only you can enter; 'ls -ld /"):
        Environment.read({"ROSZ_RENDEZVOUS": "private"})
