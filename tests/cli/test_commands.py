"""What holds for all commands: they exist, start light, and end in a line and a code."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest
from network import Network

from rosz.cli.declare import App
from rosz.cli.main import COMMANDS, run
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_its_module(name: str) -> None:
    assert isinstance(import_module(f"rosz.cli.{name}").app, App)


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
    code = f"import sys, rosz.cli.{name}; print(sorted({heavy} & set(sys.modules)))"
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
        (["parma"], 2, "'parma' is no command; did you mean 'param'?"),
        (["param", "gte"], 2, "No such command 'gte'. Did you mean 'get'? See 'rosz param --help'"),
        (["param", "get"], 2, "Missing argument 'NAME'"),
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


def test_a_meaningless_setting_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "many")
    assert run(["topic", "list"]) == 2
    assert capsys.readouterr().err == (
        "rosz: ROS_DOMAIN_ID is 'many'; expected a number from 0 to 232\n"
    )
