"""The TAB key, in real shells and by what it asks."""

from __future__ import annotations

import os
import pty
import resource
import select
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from network import TIMEOUT, Network

from rosz.cli.complete import complete, expand, split_line
from rosz.cli.env import ALIASES
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.std_srvs.srv import SetBool
from rosz.session import Session
from rosz.workspace import create

from .shell import Shell

Ask = Callable[..., list[str]]


@pytest.fixture
def system(network: Network) -> Network:
    """A node with a topic, a service and a parameter, and a package."""
    node = network.node("turtle")
    node.publisher("/turtle1/cmd_vel", Twist)
    node.service("/turtle1/pen", SetBool, lambda _: SetBool.Response())
    node.params["/turtle1/speed"] = 3
    (network.folder / "src").mkdir()
    create(network.folder / "src", "turtle_pkg")
    return network


@pytest.fixture
def ask(shell: Shell, capsys: pytest.CaptureFixture[str]) -> Ask:
    """What the TAB key asks, and gets."""
    del shell  # has set the environment

    def run(line: str, name: str = "fish") -> list[str]:
        capsys.readouterr()
        assert complete([name, line]) == 0
        out, err = capsys.readouterr()
        assert not err
        return out.splitlines()

    return run


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("rostopic ec", ["echo"]),
        ("rosz topic ec", ["echo"]),
        ("rosz doc", ["doctor"]),
        ("rosz help doc", ["doctor"]),
        ("rosz help security", ["security"]),
        ("rosz help topic ec", ["echo"]),
        ("rostopic echo /tur", ["/turtle1/cmd_vel"]),
        ("rostopic echo -n 1 /tur", ["/turtle1/cmd_vel"]),
        ("rostopic echo -p /tur", ["/turtle1/cmd_vel"]),
        ("rostopic echo /turtle1/cmd_vel/lin", ["/turtle1/cmd_vel/linear"]),
        ("rostopic echo /turtle1/cmd_vel/linear/x", ["/turtle1/cmd_vel/linear/x"]),
        ("rostopic echo /turtle1/cmd_vel/none/x", []),
        ("rostopic echo /turtle1/cmd_vel ", []),
        ("rostopic hz /turtle1/cmd_vel /tu", ["/turtle1/cmd_vel"]),
        ("rostopic find geom", ["geometry_msgs/Twist"]),
        ("rostopic pub /turtle1/cmd_vel ", ["geometry_msgs/Twist"]),
        ("rostopic pub /new std_msgs/Stri", ["std_msgs/String"]),
        ("rostopic pub /new std_msgs/String ", ["{data: ''}"]),
        ("rostopic pub --ra", ["--rate"]),
        ("rostopic pub -r 1", []),
        ("rosservice call /tur", ["/turtle1/pen"]),
        ("rosservice call /turtle1/pen ", ["{data: false}"]),
        ("rosservice call /nowhere ", []),
        ("rosservice find ", ["std_srvs/SetBool"]),
        ("rosnode info /", ["/turtle"]),
        ("rosparam get /turtle1/", ["/turtle1/speed"]),
        ("rosmsg show geometry_msgs/TwistS", ["geometry_msgs/TwistStamped"]),
        ("rossrv show std_srvs/Set", ["std_srvs/SetBool"]),
        ("rosrun turtle_", ["turtle_pkg"]),
        ("rosrun turtle_pkg ", ["talker.py"]),
        ("rosrun nowhere ", []),
        ("roslaunch turtle_", ["turtle_pkg"]),
        ("roslaunch turtle_pkg ", ["talker.launch"]),
        ("roslaunch turtle_pkg talker.launch ", ["rate:="]),
        ("roslaunch turtle_pkg talker.launch rate:=", ["rate:=1.0"]),
        ("roslaunch turtle_pkg talker.launch rate:=2 ", []),
        ("roslaunch src/turtle_pkg/launch/", ["src/turtle_pkg/launch/talker.launch"]),
        ("roslaunch src/turtle_pkg/launch/talker.launch r", ["rate:="]),
        ("rosparam load src/", ["src/turtle_pkg/"]),
        ("rosparam load src/turtle_pkg/package.xml /tur", ["/turtle1/speed"]),
        ("roscd turtle_pkg/m", ["turtle_pkg/msg/"]),
        ("rosls turtle_", ["turtle_pkg"]),
        ("rosed turtle_pkg tal", ["talker.launch", "talker.py"]),
        ("rospack find turtle_", ["turtle_pkg"]),
        ("rosz pkg check turtle_", ["turtle_pkg"]),
        ("rosz log --level w", ["warn"]),
        ("rosz env f", ["fish"]),
        ("rosz topic pub --file src/", ["src/turtle_pkg/"]),
        ("rossrv package std_s", ["std_srvs"]),
        ("rosnode machine no-such", []),
        ("rosed turtle_pkg package.xml ", []),
        ("ROS_DOMAIN_ID=42 rosnode info /t", ["/turtle"]),
        ("cd / && rosnode info /t", ["/turtle"]),
        ("rosz nothing ", []),
        ("rosz topic nothing ", []),
        ("ls ", []),
        ("", []),
    ],
)
def test_candidates(system: Network, ask: Ask, line: str, expected: list[str]) -> None:
    del system
    assert ask(line) == expected


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("rosz action ", ["info", "list", "send", "show", "type"]),
        ("rosz action info /tur", ["/turtle1/turn"]),
        ("rosz action type /tur", ["/turtle1/turn"]),
        ("rosz action send /tur", ["/turtle1/turn"]),
        ("rosz action send -f /tur", ["/turtle1/turn"]),
        ("rosz action send --fe", ["--feedback"]),
        ("rosz action send /turtle1/turn ", ["{order: 0}"]),
        ("rosz action send /turtle1/turn {order:\\ 0} ", []),
        ("rosz action send /turtle1/none ", []),
        ("rosz action show example_interfaces/Fib", ["example_interfaces/Fibonacci"]),
    ],
)
def test_candidates_of_actions(network: Network, ask: Ask, line: str, expected: list[str]) -> None:
    server = network.node("server")
    server.action_server("/turtle1/turn", Fibonacci, lambda goal: goal.succeed())
    assert ask(line) == expected


@pytest.mark.parametrize(
    ("shell_name", "line", "expected"),
    [
        ("bash", "roslaunch turtle_pkg talker.launch rate:=", ["1.0"]),
        ("zsh", "roslaunch turtle_pkg talker.launch rate:=", ["rate:=1.0"]),
        ("bash", "rostopic pub /new std_msgs/String ", ["'{data: '\"'\"''\"'\"'}'"]),
        ("fish", "rostopic pub /new std_msgs/String ", ["{data: ''}"]),
    ],
)
def test_candidates_as_a_shell_takes_them(
    system: Network, ask: Ask, shell_name: str, line: str, expected: list[str]
) -> None:
    del system
    assert ask(line, shell_name) == expected


@pytest.mark.parametrize(
    "line", ["rostopic echo /", "rosnode info ", "rosparam get ", "rosservice call "]
)
def test_an_empty_network_gives_nothing_at_once(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    monkeypatch.setattr(Session, "open", pytest.fail)  # which would wait for an answer
    assert ask(line) == []


def test_a_network_that_hangs_gives_nothing_soon(network: Network) -> None:
    with socket.socket(socket.AF_UNIX) as mute:
        mute.bind(str(network.folder / "z.sock"))
        mute.listen()
        words = ("complete", "bash", "rostopic echo /")
        program = network.run("-m", "rosz", *words, ROSZ_COMPLETION_TIMEOUT="0.5")
        assert program.exit_code() == 0
        assert program.output == ""


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("rosz msg show std_msgs/Str", "std_msgs/String"),
        ("roslaunch turtle_p", "turtle_pkg"),
        ("rostopic pub /turtle1/cmd_vel geometry_msgs/Tw", "geometry_msgs/Twist"),
        ("rosz tf ec", "echo"),
    ],
)
def test_what_is_on_the_disk_comes_on_a_slow_machine(
    network: Network, line: str, expected: str
) -> None:
    create(network.folder, "turtle_pkg")
    with socket.socket(socket.AF_UNIX) as mute:
        mute.bind(str(network.folder / "z.sock"))
        mute.listen()
        words = ("complete", "fish", line)
        limits = {"ROSZ_COMPLETION_TIMEOUT": "1e-3", "ROS_PACKAGE_PATH": str(network.folder)}
        program = network.run("-m", "rosz", *words, **limits)
        assert program.exit_code() == 0
        assert expected in program.lines


def test_live_candidates_that_came_in_time(
    system: Network, ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replies that do not end, as where a machine was cut off, hide none of those that came."""
    find = Session.live_tokens

    def wait_for_more(session: Session, key: str, timeout: float, looks: int = 1) -> list[str]:
        time.sleep(timeout)
        return find(session, key, timeout, looks)

    assert system.domain
    monkeypatch.setattr(Session, "live_tokens", wait_for_more)
    monkeypatch.setenv("ROSZ_COMPLETION_TIMEOUT", "8")
    assert ask("rostopic echo /turt") == ["/turtle1/cmd_vel"]


def test_completion_takes_little_processor_time(system: Network) -> None:
    def measure(*words: str) -> tuple[str, float]:
        """Return the output of Python, and its processor time, which others do not lengthen."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [sys.executable, *words],
            env=system.variables(),
            capture_output=True,
            text=True,
            timeout=300,
            check=True,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    _, base = measure("-c", "import rosz.session")
    output, seconds = measure("-m", "rosz", "complete", "bash", "rostopic echo /")
    assert output == "/rosout\n/turtle1/cmd_vel\n"
    assert seconds < 4 * base  # it takes as long


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("rostopic ec", ["rostopic", "ec"]),
        ("rostopic echo ", ["rostopic", "echo", ""]),
        ("a | b;c 'x y' ", ["c", "x y", ""]),
        ("x $(rostopic ec", ["rostopic", "ec"]),
        ('a "b c', ["a", "b c"]),
        ("a 'b c", ["a", "b c"]),
        ("a 'b\" ", ["a", 'b" ']),
        ("a |", None),
    ],
)
def test_split_line(line: str, words: list[str] | None) -> None:
    assert split_line(line) == words


def test_expand() -> None:
    assert expand(["/opt/bin/rostopic", "echo"]) == ["rosz", "topic", "echo"]
    assert expand(["catkin_create_pkg"]) == ["rosz", "pkg", "create", "--bare"]
    assert expand(["A=1", "B=2", "rosz", "topic"]) == ["rosz", "topic"]
    assert expand(["roscd", "x"]) == ["roscd", "x"]
    assert expand(["A=1"]) == expand(["ls"]) == []


@pytest.mark.parametrize("alias", ALIASES)
def test_every_alias_completes(ask: Ask, alias: str) -> None:
    lines = [f"{alias} -", f"{alias} list -", f"{alias} info -"]
    assert any(candidate.startswith("-") for line in lines for candidate in ask(line))


class Terminal:
    """A shell that a person types into.

    Args:
        command: The shell.
        network: Where.
    """

    def __init__(self, command: list[str], network: Network) -> None:
        self._said = b""
        self.pid, self._file = pty.fork()
        if self.pid == 0:
            os.chdir(network.folder)
            os.execvpe(command[0], command, {**network.variables(TERM="dumb"), "PS1": "> "})

    def type(self, text: str) -> None:
        os.write(self._file, text.encode())

    def wait_for(self, text: str, timeout: float = TIMEOUT) -> str:
        """Read until a text is there, and return all that came."""
        deadline = time.monotonic() + timeout
        while text.encode() not in self._said:
            ready, _, _ = select.select([self._file], [], [], max(0, deadline - time.monotonic()))
            if not ready:
                pytest.fail(f"no {text!r}, but {self._said.decode(errors='replace')!r}")
            self._said += os.read(self._file, 4096)
        said, self._said = self._said.decode(errors="replace"), b""
        return said

    def close(self) -> None:
        os.kill(self.pid, 9)
        os.waitpid(self.pid, 0)
        os.close(self._file)


SHELLS = {"bash": ["bash", "--norc", "--noprofile", "-i"], "zsh": ["zsh", "-f", "-i"]}


@pytest.fixture(params=SHELLS)
def terminal(system: Network, request: pytest.FixtureRequest) -> Iterator[Terminal]:
    """An interactive shell with ROS 1's names."""
    name = request.param
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed: apt install {name}")
    made = Terminal(SHELLS[name], system)
    made.type(f'eval "$({sys.executable} -m rosz env {name})"; echo rea""dy\n')
    made.wait_for("ready\r\n")
    yield made
    made.close()


def test_the_tab_key_completes_in_a_terminal(terminal: Terminal) -> None:
    # What is completed is what the command then gets.
    terminal.type("rostopic type /tur\t\n")
    terminal.wait_for("geometry_msgs/Twist\r\n")
    terminal.type("rosparam get /turtle1/s\t\n")
    terminal.wait_for("\n3\r\n")
    terminal.type("rosservice call /turtle1/pen \t\n")
    terminal.wait_for("success: ")
    terminal.type("roslaunch turtle_pkg tal\tra\t2 --nodes\n")
    terminal.wait_for("\n/talker\r\n")
    terminal.type("roscd turtle_pkg/la\t; pwd\n")
    terminal.wait_for("src/turtle_pkg/launch\r\n")


def test_fish_completes(system: Network) -> None:
    if shutil.which("fish") is None:
        pytest.skip("fish is not installed: apt install fish")
    env = f"{sys.executable} -m rosz env fish | source"
    asked = ["rostopic type /tur", "roslaunch turtle_pkg talker.launch ra", "rosz topic ec"]
    done = subprocess.run(
        ["fish", "--no-config", "-c", "; ".join([env, *(f"complete -C '{a}'" for a in asked)])],
        env=system.variables(),
        cwd=system.folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert done.stdout == "/turtle1/cmd_vel\nrate:=\necho\n"
    assert not done.stderr


def test_a_path_that_begins_with_a_tilde(ask: Ask, network: Network) -> None:
    (network.folder / "values.yaml").touch()
    assert ask("rosparam load ~/val") == ["~/values.yaml"]
    assert Path("~").expanduser() == network.folder
