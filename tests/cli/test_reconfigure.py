from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest
from network import Network, Program, eventually
from reconfigure.robots import Robot

from rosz.reconfigure import Config, Description, Server, Setting

from .shell import Shell

VALUES = {
    "enabled": True,
    "steps": 50,
    "size": 0,
    "taps": 3,
    "label": "hello",
    "gain": 0.5,
    "cutoff": 2.5,
}
SERVER = """
    import rosz
    from rosz.reconfigure import Description, Server, Setting
    with rosz.Node("late") as node:
        Server(node, Description([Setting("steps", 50)]))
        print("ready", flush=True)
        node.spin()
"""
DYNPARAM = ("run", "dynamic_reconfigure", "dynparam")


@pytest.fixture
def robot(network: Network) -> Robot:
    return Robot(network.node("robot"))


pytestmark = pytest.mark.usefixtures("robot")


def test_list(shell: Shell, robot: Robot) -> None:
    Robot(robot.server.node, "left")
    assert shell("reconfigure", "list").lines == ["/robot", "/robot/left"]
    assert shell("reconfigure", "list", "--json").json == ["/robot", "/robot/left"]


def test_get_prints_what_dynparam_prints(shell: Shell) -> None:
    (line,) = shell("reconfigure", "get", "robot").lines
    found = eval(line)
    assert Config(found).groups["groups"]["Filter"]["groups"]["Deep"]["taps"] == 3
    del found["groups"]
    assert found == VALUES
    assert list(found) == list(VALUES)


def test_get_as_json(shell: Shell) -> None:
    found = shell("reconfigure", "get", "robot", "--json").json
    assert found.pop("groups")["groups"]["Filter"]["state"] is False
    assert found == VALUES


@pytest.mark.parametrize(
    ("setting", "text", "value"),
    [("gain", "0.5", 0.5), ("label", "hello", "hello"), ("enabled", "true", True)],
)
def test_get_of_one(shell: Shell, setting: str, text: str, value: object) -> None:
    assert shell("reconfigure", "get", "robot", setting).out == f"{text}\n"
    assert shell("reconfigure", "get", "robot", setting, "--json").json == value


@pytest.mark.parametrize(
    ("words", "changed"),
    [
        (["gain", "2"], {"gain": 2.0}),
        (["steps", "0x1f"], {"steps": 31}),
        (["size", "large"], {"size": 2}),
        (["label", "007"], {"label": "007"}),
        (["label", "-x"], {}),
        (["--", "label", "-x"], {"label": "-x"}),
        (["enabled", "no"], {"enabled": False}),
        (["{gain: 1, label: abc, size: Large}"], {"gain": 1.0, "label": "abc", "size": 2}),
        (["{}"], {}),
    ],
)
def test_set(shell: Shell, robot: Robot, words: list[str], changed: dict[str, object]) -> None:
    result = shell("reconfigure", "set", "robot", *words)
    config = robot.server.config
    del config["groups"]
    assert config == VALUES | changed
    if words == ["label", "-x"]:
        assert result.code == 2
        return
    assert (result.code, result.out, result.err) == (0, "", "")


def test_set_warns_of_a_changed_value(shell: Shell) -> None:
    result = shell("reconfigure", "set", "robot", "gain", "-3")
    assert result.code == 0
    assert result.err == "WARNING: gain is 0.0 and not -3.0: the node decided so\n"


def test_set_as_json(shell: Shell) -> None:
    assert shell("reconfigure", "set", "robot", "steps", "7", "--json").json["steps"] == 7


def test_groups_are_set_by_name(shell: Shell, robot: Robot) -> None:
    assert shell("reconfigure", "set", "robot", "{groups: {Filter: true}}").code == 0
    assert robot.server.config.groups.groups.Filter.state is True


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["get", "robt"], 1, "no node has settings under '/robt'; did you mean '/robot'?"),
        (["get", "other"], 1, "no node has settings under '/other'; 'rosz reconfigure list' lists"),
        (["get", "robot", "gian"], 1, "there is no setting 'gian'; did you mean 'gain'?"),
        (["set", "robot", "gian", "1"], 1, "there is no setting 'gian'; did you mean 'gain'?"),
        (["set", "robot", "gain", "x"], 1, "'gain' cannot be 'x': expected a number"),
        (["set", "robot", "[1]"], 1, "<value>: [1]: expected a dictionary of names to values"),
        (["set", "robot", "a", "b", "c"], 2, "got unexpected extra argument(s) (c); see 'rosz"),
        (["set", "robot"], 2, "missing argument"),
        (["describe", "robot", "gian"], 1, "there is no setting 'gian'; did you mean 'gain'?"),
        (["load", "robot", "no.yaml"], 1, "no.yaml: No such file or directory"),
        (["set_from_parameters", "robot"], 1, "no parameters are set under '/dynparam_"),
        (["get", "-t", "0", "robot"], 2, "--timeout is 0; expected seconds above 0"),
        (["get", "-t", "0.1", "robt"], 1, "no node with settings under '/robt' within 0.1 s; did"),
        (["watch", "robot", "-n", "0"], 2, "-n is 0; expected 1 or more"),
    ],
)
def test_errors(shell: Shell, words: list[str], code: int, text: str) -> None:
    result = shell("reconfigure", *words)
    assert (result.code, result.out) == (code, "")
    assert result.err.startswith(f"ERROR: {text}")
    assert result.err.count("\n") == 1


def test_the_refusal_of_a_node_is_reported(shell: Shell, robot: Robot) -> None:
    robot.answer = {"gain": "nonsense"}
    result = shell("reconfigure", "set", "robot", "steps", "1")
    assert result.code == 1
    assert "service [/robot/set_parameters] responded with an error" in result.err
    assert "'gain' cannot be 'nonsense'" in result.err


def test_describe(shell: Shell) -> None:
    assert shell("reconfigure", "describe", "robot").out == (
        """\
gain (double) = 0.5
    Gain of the loop
    default 0.5, min 0.0, max 10.0, level 1
steps (int) = 50
    Number of steps
    default 50, min 0, max 100, level 2
label (str) = 'hello'
    What it is called
    default 'hello', level 4
enabled (bool) = True
    Whether it runs
    default True, level 8
size (int) = 0
    How large it is
    default 0, min 0, max 2, level 16
    Small  0  A small one
    Large  2  A large one
[Filter] collapse, not shown
  cutoff (double) = 2.5
      Hertz
      default 2.5, min -inf, max inf, level 32
  [Deep] tab
    taps (int) = 3
        default 3, min -2147483648, max 2147483647, level 64
[Other]
"""
    )


def test_describe_one(shell: Shell) -> None:
    assert shell("reconfigure", "describe", "robot", "cutoff").lines == [
        "cutoff (double) = 2.5",
        "    Hertz",
        "    default 2.5, min -inf, max inf, level 32",
    ]


def test_describe_as_json(shell: Shell) -> None:
    found = shell("reconfigure", "describe", "robot", "--json").json
    assert [one["name"] for one in found["settings"]] == [
        "gain", "steps", "label", "enabled", "size", "cutoff", "taps",
    ]  # fmt: skip
    assert found["groups"][2] == {
        "name": "Deep", "id": 2, "parent": 1, "type": "tab", "settings": ["taps"],
    }  # fmt: skip
    assert shell("reconfigure", "describe", "robot", "size", "--json").json == {
        "name": "size",
        "type": "int",
        "value": 0,
        "default": 0,
        "min": 0,
        "max": 2,
        "level": 16,
        "description": "How large it is",
        "choices": [
            {"name": "Small", "value": 0, "description": "A small one"},
            {"name": "Large", "value": 2, "description": "A large one"},
        ],
    }


def test_dump_and_load(shell: Shell, robot: Robot) -> None:
    robot.server.update({"gain": 7, "groups": {"Filter": True}})
    assert shell("reconfigure", "dump", "robot", "saved.yaml").out == ""
    robot.server.update({"gain": 1, "groups": {"Filter": False}})
    assert shell("reconfigure", "load", "robot", "saved.yaml").out == ""
    assert robot.server.config.gain == 7
    assert robot.server.config.groups.groups.Filter.state is True
    text = shell("reconfigure", "dump", "robot", "-").out
    assert text.startswith("cutoff: 2.5\n")
    changed = text.replace("steps: 50", "steps: 51")
    assert shell("reconfigure", "load", "robot", "-", stdin=changed).code == 0
    assert robot.server.config.steps == 51


def test_load_names_the_place_of_a_fault(shell: Shell, network: Network) -> None:
    (network.folder / "saved.yaml").write_text("gain: 1\nsteps: [\n")
    result = shell("reconfigure", "load", "robot", "saved.yaml")
    assert (result.code, result.err.split(": ")[1]) == (1, "saved.yaml:3:1")


def test_set_from_parameters(shell: Shell, robot: Robot) -> None:
    words = ("set_from_parameters", "robot", "_gain:=2", "_label:=from here")
    assert shell("reconfigure", *words).code == 0
    assert (robot.server.config.gain, robot.server.config.label) == (2.0, "from here")


def test_names_resolve_as_for_other_commands(shell: Shell, network: Network) -> None:
    Robot(network.node("robot", namespace="/a"))
    assert shell("reconfigure", "get", "robot", "steps", "__ns:=/a").out == "50\n"
    assert shell("reconfigure", "get", "it", "steps", "it:=/a/robot").out == "50\n"


def test_watch(shell: Shell, robot: Robot) -> None:
    program = shell.start("reconfigure", "watch", "robot", "-n", "3")
    program.wait_for("watching [/robot]")
    robot.server.update({"gain": 3})
    robot.server.update({"label": "x y", "groups": {"Deep": False}})
    assert program.exit_code() == 0
    assert program.lines[1:] == [
        "~ gain: 0.5 -> 3.0",
        "~ label: hello -> x y",
        "~ groups/Filter/Deep: true -> false",
    ]


def test_watch_as_json_until_stopped(shell: Shell, robot: Robot) -> None:
    program = shell.start("reconfigure", "watch", "robot", "--json")
    program.wait_for("watching [/robot]")
    robot.server.update({"gain": 3})
    line = program.wait_for("gain")
    assert json.loads(line) == {"name": "gain", "old": 0.5, "new": 3.0}
    program.send(signal.SIGINT)
    assert program.exit_code() == 0


def test_waiting_for_a_node(shell: Shell, network: Network) -> None:
    program = shell.start("reconfigure", "set", "--wait", "late", "steps", "3", "--json")
    program.wait_for("Waiting for service /late/set_parameters...")
    late = network.node("late")
    server = Server(late, Description([Setting("steps", 50)]))
    assert program.exit_code() == 0
    assert server.config.steps == 3


def test_dynparam_waits_as_in_ros1(shell: Shell, network: Network) -> None:
    program = shell.start(*DYNPARAM, "get", "late")
    program.wait_for("Waiting for service /late/set_parameters...")
    server = Server(network.node("late"), Description([Setting("steps", 50)]))
    assert program.exit_code() == 0
    assert program.lines[-1].startswith("{'steps': 50, 'groups': ")
    server.close()
    eventually(lambda: shell("reconfigure", "list").lines == ["/robot"], "the end of the server")
    program = shell.start(*DYNPARAM, "get", "-t", "0.2", "late")
    assert program.exit_code() == 1
    assert "no node with settings under '/late' within 0.2 s" in program.output


def stopped(program: Program) -> bool:
    """Tell whether no thread of a program runs any more, which a signal takes its time for."""
    tasks = Path(f"/proc/{program.pid}/task").glob("*/stat")
    try:
        return all(task.read_text().rpartition(")")[2].split()[0] == "T" for task in tasks)
    except (FileNotFoundError, ProcessLookupError):  # a thread has ended meanwhile
        return False


def test_a_stopped_node_does_not_block(shell: Shell, network: Network) -> None:
    program = network.program(SERVER)
    program.wait_for("ready")
    assert shell("reconfigure", "get", "late", "steps").out == "50\n"
    program.send(signal.SIGSTOP)
    eventually(lambda: stopped(program), "all threads stopped")
    try:
        assert shell("reconfigure", "get", "-t", "0.5", "late").code == 1
        assert shell("reconfigure", "set", "-t", "0.5", "late", "steps", "1").code == 1
        assert shell("reconfigure", "get", "robot", "steps").out == "50\n"
    finally:
        program.send(signal.SIGCONT)
