"""What holds for all commands: they exist, start light, and end in a line and a code."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest
from network import Network

from rosz.cli.commands import COMMANDS, load
from rosz.cli.declare import App
from rosz.cli.main import run
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_its_module(name: str) -> None:
    assert isinstance(load(name), App)


def test_the_overview_loads_nothing() -> None:
    code = (
        "import sys; from rosz.cli.main import run; run(['--help']); "
        "print(sorted({'zenoh', 'typer', 'yaml', 'msgspec', 'numpy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("name", [*COMMANDS])
def test_a_command_loads_little(name: str) -> None:
    heavy = {"asyncio", "numpy", "rosz.node", "rosz.msgs.std_msgs", "rich"}
    code = f"""
import sys
from rosz.cli.commands import load
load({name!r})
print(sorted({heavy} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


HEAVY = {
    "asyncio",
    "importlib.metadata",
    "numpy",
    "pydantic",
    "rich",
    "rosz.idl.grammar",
    "rosz.launch",
    "rosz.msgs",
    "rosz.node",
    "rosz.params",
    "rosz.typestore",
    "yaml",
    "zenoh",
}
"""What takes its time to load, and only some commands need."""


@pytest.mark.parametrize(
    ("line", "needs"),
    [
        ("--help", set()),
        ("topic list", {"zenoh"}),
        ("topic info /chatter", {"zenoh"}),
        ("topic find std_msgs/String", {"zenoh"}),
        ("service list", {"zenoh"}),
        ("service type /reset", {"zenoh"}),
        ("node list", {"zenoh"}),
        ("node machine", {"zenoh"}),
        ("param get /speed", {"zenoh", "rosz.params"}),
        ("param set /speed 4", {"zenoh", "rosz.params", "yaml"}),
        ("msg md5 std_msgs/String", {"zenoh", "rosz.msgs", "rosz.typestore", "rosz.idl.grammar"}),
        ("pkg find rosz_tutorials", {"zenoh", "importlib.metadata"}),
        ("env bash", {"zenoh"}),
        ("complete bash rostopic echo /", {"zenoh"}),
    ],
)
def test_a_command_loads_what_it_needs(network: Network, line: str, needs: set[str]) -> None:
    node = network.node("talker")
    node.publisher("/chatter", String)
    node.service("/reset", Empty, lambda _: Empty.Response())
    node.params["/speed"] = 3
    program = network.program(
        """
        import sys
        from rosz.cli.main import run
        code = run(sys.argv[1:])
        print("\\nloaded", code, *sys.modules)
        """,
        *line.split(" ", 2 if line.startswith("complete") else -1),
    )
    _, code, *loaded = program.wait_for("loaded ").split()
    assert code == "0", program.output
    assert HEAVY & set(loaded) <= needs


@pytest.mark.parametrize(
    ("argv", "code", "text"),
    [
        (["parma"], 2, "'parma' is not a command; did you mean 'param'?"),
        (["param", "gte"], 2, "ERROR: no such command 'gte'; did you mean 'get'?\n"),
        (["param", "get"], 2, "ERROR: missing argument 'NAME'; see 'rosz param get --help'\n"),
    ],
)
def test_wrong_usage(
    argv: list[str], code: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(argv) == code
    written = capsys.readouterr()
    assert text in written.err
    assert written.err.count("\n") == 1
    assert not written.out


def test_an_invalid_setting_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "many")
    assert run(["topic", "list"]) == 2
    assert capsys.readouterr().err == (
        "ERROR: ROS_DOMAIN_ID is 'many'; expected a number from 0 to 232\n"
    )


def test_a_deleted_working_folder_is_reported(network: Network) -> None:
    (network.folder / "gone").mkdir()
    line = f'cd gone && rmdir ../gone && "{sys.executable}" -P -m rosz pkg check'
    done = subprocess.run(
        ["sh", "-c", line],
        cwd=network.folder,
        env=network.variables(),
        capture_output=True,
        text=True,
        check=False,
    )
    expected = "ERROR: the working folder has been deleted: change to another one with 'cd'\n"
    assert (done.returncode, done.stderr) == (1, expected)


def test_a_full_disk_is_reported_with_the_file(network: Network) -> None:
    node = network.node()
    node.params.set("/a", 1)
    line = [sys.executable, "-P", "-m", "rosz", "param", "dump"]
    done = subprocess.run(
        [*line, "/dev/full"], env=network.variables(), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (1, "ERROR: /dev/full: No space left on device\n")


@pytest.mark.parametrize("unbuffered", ["", "1"], ids=["buffered", "unbuffered"])
@pytest.mark.parametrize("size", [1, 100_000], ids=["little", "much"])
def test_a_full_disk_is_reported_with_standard_output(
    network: Network, unbuffered: str, size: int
) -> None:
    network.node().params.set("/a", "x" * size)
    with open("/dev/full", "w") as full:  # noqa: PTH123  # a device, written to by a child
        done = subprocess.run(
            [sys.executable, "-P", "-m", "rosz", "param", "get", "/a"],
            env=network.variables(PYTHONUNBUFFERED=unbuffered),
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    expected = "ERROR: cannot write to standard output: No space left on device\n"
    assert (done.returncode, done.stderr) == (1, expected)


STOPPED_TWICE = """
import signal, sys
signal.signal(signal.SIGINT, signal.SIG_DFL)
from rosz.cli import console
console._SAME_REQUEST_SECONDS = float(sys.argv[1])
with console.until_stopped() as ready:
    ready()
    try:
        signal.raise_signal(signal.SIGTERM)
    except KeyboardInterrupt:
        print("stopping", flush=True)
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            print("twice", flush=True)
print("stopped", flush=True)
"""


@pytest.mark.parametrize(
    ("seconds", "code", "out"),
    [("-1", -signal.SIGINT, "stopping\n"), ("60", 0, "stopping\nstopped\n")],
)
def test_a_second_signal_is_ignored_for_a_second_and_then_ends_at_once(
    seconds: str, code: int, out: str
) -> None:
    done = subprocess.run(
        [sys.executable, "-c", STOPPED_TWICE, seconds],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, out, "")


@pytest.mark.parametrize(
    ("variable", "value", "code", "reason"),
    [
        ("ROSZ_CONNECT", "bogus", 2, "ROSZ_CONNECT is 'bogus'; expected PROTOCOL/ADDRESS"),
        (
            "ZENOH_SESSION_CONFIG_URI",
            "/nonexistent.json5",
            1,
            "cannot read the Zenoh configuration: No such file",
        ),
    ],
)
def test_a_refused_setting_is_reported_beside_a_live_node(
    network: Network, variable: str, value: str, code: int, reason: str
) -> None:
    network.node()
    done = subprocess.run(
        [sys.executable, "-P", "-m", "rosz", "topic", "list"],
        env=network.variables(**{variable: value}),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code
    assert done.stderr.startswith(f"ERROR: {reason}")


def test_a_topic_without_a_name(network: Network, capsys: pytest.CaptureFixture[str]) -> None:
    del network
    assert run(["topic", "type", ""]) == 1
    expected = "ERROR: '' is not a valid name: it is empty; expected the name of a topic\n"
    assert capsys.readouterr().err == expected
