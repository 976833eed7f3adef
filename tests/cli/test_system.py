"""Lists are up to date at once, and no command hangs or ends in a traceback."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import threading

import pytest
from network import TIMEOUT, Network, Program, eventually, repeats

from rosz.cli.commands import load
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Node

from .command import read_all
from .shell import Shell

ROBOT = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Empty
    node = rosz.Node(sys.argv[1])
    node.publisher("~texts", String)
    node.service("~reset", Empty, lambda _: Empty.Response())
    print("up", flush=True)
    node.spin()
    """


def robot(network: Network, name: str) -> Program:
    """Start a node with a topic and a service, as a process."""
    program = network.program(ROBOT, name)
    program.wait_for("up")
    return program


@pytest.mark.parametrize(
    "alone", [False, True], ids=["beside another", "holding the meeting point"]
)
def test_a_node_killed_is_gone_at_once_from_every_list(
    shell: Shell, network: Network, *, alone: bool
) -> None:
    if alone:
        victim = robot(network, "victim")
        network.node("other")
    else:
        network.node("other")
        victim = robot(network, "victim")
    assert "/victim" in shell("node", "list").lines
    victim.kill()
    for words in (
        ["node", "list"],
        ["topic", "list"],
        ["service", "list"],
        ["topic", "list", "-v"],
    ):
        result = shell(*words)
        assert "victim" not in result.out, result
    assert "/other" in shell("node", "list").lines


def test_a_command_right_after_a_start_sees_it(shell: Shell, network: Network) -> None:
    network.node("first")
    for number in range(repeats(5, 50)):
        program = robot(network, f"robot{number}")
        assert f"/robot{number}" in shell("node", "list").lines
        assert f"/robot{number}/texts" in shell("topic", "list").lines
        assert f"/robot{number}/reset" in shell("service", "list").lines
        program.kill()


def test_200_nodes_of_a_process_are_all_listed(shell: Shell, network: Network) -> None:
    context = network.context()
    for number in range(200):
        node = network.node(f"node{number:03}", context=context)
        node.publisher("~texts", String)
        node.service("~reset", Empty, lambda _: Empty.Response())
    names = [f"/node{number:03}" for number in range(200)]
    assert shell("node", "list").lines == names
    assert [line for line in shell("topic", "list").lines if line != "/rosout"] == [
        f"{name}/texts" for name in names
    ]
    assert {f"{name}/reset" for name in names} <= set(shell("service", "list").lines)


def test_nodes_of_many_processes_are_all_listed(shell: Shell, network: Network) -> None:
    network.node("first")
    count = repeats(8, 100)
    programs = [network.program(ROBOT, f"robot{number:03}") for number in range(count)]
    for program in programs:
        program.wait_for("up", timeout=120)
    names = ["/first", *(f"/robot{number:03}" for number in range(count))]
    assert shell("node", "list").lines == names


ASKING = [
    "topic list",
    "topic info /x",
    "topic type /x",
    "topic find std_msgs/String",
    "topic echo /x",
    "topic hz /x",
    "topic pub -1 /x std_msgs/String hello",
    "service list",
    "service type /x",
    "service call /x",
    "node list",
    "node info /x",
    "node ping -c 1 /x",
    "node machine",
    "node kill /x",
    "param list",
    "param get /x",
    "param set /x 1",
    "param delete /x",
]


@pytest.mark.parametrize("line", ASKING)
def test_a_command_on_an_empty_network_says_so(
    shell: Shell, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    monkeypatch.setattr("rosz.introspect.connect._BUSY_TIMEOUT", 3600)  # for what runs, only
    result = shell(*line.split())
    assert result.code == (2 if line.startswith("service call") else 1)  # as in ROS 1
    assert result.out in {"", "rosnode: node is [/x]\n"}  # which rosnode says before it looks
    assert "nobody answers" in result.err or "no replica" in result.err.lower()
    assert result.err.count("\n") == 1


BEGUN = """
    import signal
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # what main does first
    print("begun", flush=True)
    from rosz.__main__ import main
    main()
    """
"""The command, without Python's own start, in which nobody can say what Ctrl-C does."""

FOLLOWING = ["topic echo /talker/texts", "topic hz /talker/texts", "log", "core", "param watch /"]


@pytest.mark.parametrize(
    "line", [*FOLLOWING, "node ping /talker", "topic pub /x std_msgs/String a"]
)
def test_ctrl_c_never_prints_a_traceback(network: Network, talker: Node, line: str) -> None:
    talker.params["/speed"] = 1
    talker.publisher("~texts", String)
    if line == "core":
        network = Network()
    try:
        for moment in range(repeats(4, 40)):
            # Not with warnings as errors: an import that is interrupted leaves its file to be
            # closed with a warning, which Python would print with a traceback.
            program = network.program(BEGUN, *line.split(), PYTHONWARNINGS="")
            program.wait_for("begun")
            # Wherever it stands just then: anywhere from its imports to its work.
            threading.Event().wait(0.4 * moment / repeats(4, 40))
            program.send(signal.SIGINT)
            code = program.exit_code()
            assert "Traceback" not in program.output, program.output
            # The signal itself ends what has not even begun.
            assert code in {0, 130, -signal.SIGINT}, program.output
    finally:
        if line == "core":
            network.close()


def test_ctrl_c_during_the_start_prints_nothing(network: Network, talker: Node) -> None:
    talker.params["/speed"] = 1
    moments = repeats(25, 250)
    for moment in range(moments):
        program = network.run("-m", "rosz", "param", "list")
        threading.Event().wait(0.1 * moment / moments)  # from Python's own start to the answer
        program.send(signal.SIGINT)
        program.exit_code()
        for place in ("rosz/cli", "rosz/session", "rosz/errors", "zenoh", "msgspec"):
            assert place not in program.output, program.output


WRITING = [
    "--help",
    "topic --help",
    "topic list",
    "topic echo /robot/text",
    "node list",
    "node info /talker",
    "service list",
    "param list",
    "param get /",
    "param dump",
    "reconfigure list",
    "msg list",
    "msg packages",
    "srv list",
    "msg show std_msgs/String",
    "pkg list",
    "env bash",
    "doctor",
    "log",
]


@pytest.mark.parametrize("line", WRITING)
def test_a_closed_pipe_ends_it_quietly(network: Network, talker: Node, line: str) -> None:
    talker.params["/speed"] = 1
    talker.timer(0.02, lambda _: talker.log.info("on and on"))
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "rosz", *line.split()],
        env=network.variables(),
        stdin=subprocess.DEVNULL,
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        timeout=300,
        check=False,
    )
    os.close(writing)
    assert done.stderr == ""
    assert done.returncode in {0, 1}  # the doctor's, where a warning ended it


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-", "2>&1 | true"])
@pytest.mark.parametrize(
    "line", ["topic list", "param get /speed", "bogus", "msg md5 std_msgs/Bool"]
)
def test_closed_streams_are_not_an_error(
    network: Network, talker: Node, line: str, closed: str
) -> None:
    talker.params["/speed"] = 1
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m rosz {line} {closed}"],
        env=network.variables(),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if "|" not in closed:
        assert done.returncode == (2 if line == "bogus" else 0)
    assert "Traceback" not in done.stderr
    assert "ignored" not in done.stderr


def test_a_full_disk_is_reported(network: Network, talker: Node) -> None:
    talker.params["/speed"] = 1
    with open("/dev/full", "w", encoding="utf-8") as full:  # noqa: PTH123  # it is no file
        done = subprocess.run(
            [sys.executable, "-m", "rosz", "param", "get", "/speed"],
            env={**network.variables(), "PYTHONUNBUFFERED": ""},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=300,
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr == "ERROR: cannot write to standard output: No space left on device\n"


ENDING = """
    import atexit, sys, threading
    from rosz.cli import main
    atexit.register(print, "at the exit")
    if sys.argv.pop(1) == "busy":
        def end():
            threading.main_thread().join()
            print("the thread")
        threading.Thread(target=end).start()
    main.main()
    """


@pytest.mark.parametrize(
    ("state", "last"), [("idle", ["at the exit"]), ("busy", ["the thread", "at the exit"])]
)
def test_exit_functions_and_threads_are_waited_for(
    network: Network, state: str, last: list[str]
) -> None:
    program = network.program(ENDING, state, "--help")
    assert program.exit_code() == 0
    assert program.lines[-len(last) :] == last


def on_terminal(network: Network, *words: str, **variables: str) -> bytes:
    """Run a command to its end on a terminal, and return what it wrote there."""
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "rosz", *words],
        env=network.variables(**variables),
        cwd=network.folder,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
    ) as process:
        os.close(theirs)
        written = read_all(ours)
        process.wait(TIMEOUT)
    return written


@pytest.mark.parametrize("words", [["doctor"], ["log", "-n", "1"], ["pkg", "check", "odd"]])
def test_colours_are_for_terminals_that_want_them(
    network: Network, talker: Node, words: list[str]
) -> None:
    talker.timer(0.02, lambda _: talker.log.error("ouch"))
    (network.folder / "odd").mkdir()
    (network.folder / "odd" / "package.xml").write_text("<package/>")
    assert b"\x1b[3" in on_terminal(network, *words)
    assert b"\x1b[3" not in on_terminal(network, *words, NO_COLOR="1")
    plain = network.run(
        "-m", "rosz", *(str(network.folder / w) if w == "odd" else w for w in words)
    )
    plain.exit_code()
    assert "\x1b" not in plain.output


def test_progress_is_for_terminals(network: Network) -> None:
    (network.folder / "odd").mkdir()
    (network.folder / "odd" / "package.xml").write_text("<package/>")
    assert b"[100%] odd" in on_terminal(network, "pkg", "check", "odd", NO_COLOR="1")
    plain = network.run("-m", "rosz", "pkg", "check", str(network.folder / "odd"))
    plain.exit_code()
    assert "100%" not in plain.output


SHOWING = {
    "topic": ["list", "info", "type", "find", "echo", "hz", "bw", "delay"],
    "service": ["list", "info", "type", "find", "args", "node", "uri", "call"],
    "node": ["list", "info", "machine"],
    "param": ["list", "get", "search", "watch"],
    "msg": ["list", "show", "info", "md5", "hash", "package", "packages"],
    "srv": ["list", "show", "info", "md5", "hash", "package", "packages"],
    "pkg": ["list", "find", "check"],
    "reconfigure": ["list", "get", "describe", "watch"],
    "keys": ["list", "check"],
    "log": [""],
    "doctor": [""],
    "env": [""],
}


@pytest.mark.parametrize(
    ("group", "command"), [(group, name) for group, names in SHOWING.items() for name in names]
)
def test_every_command_that_shows_something_takes_json(group: str, command: str) -> None:
    parameters = load(group).commands[command].parameters()
    assert any("--json" in one.spellings for one in parameters)


def test_measures_as_json(shell: Shell, talker: Node) -> None:
    texts = talker.publisher("~texts", String)
    talker.timer(0.02, lambda _: texts.publish(String("hello")))
    for command, field in (("hz", '"rate":'), ("bw", '"topic":"/talker/texts"')):
        program = shell.start("topic", command, "--json", "/talker/texts")
        line = program.wait_for(field)
        assert line.startswith('{"topic":"/talker/texts",')
        assert program.lines[0] == line
        program.send(signal.SIGINT)
        assert program.exit_code() == 0


def test_short_outputs_as_json(shell: Shell, talker: Node) -> None:
    talker.service("/reset", Empty, lambda _: Empty.Response())
    eventually(lambda: "/reset" in shell("service", "list").lines, "the service")
    assert shell("service", "type", "--json", "/reset").json == {"type": "std_srvs/Empty"}
    assert shell("service", "args", "--json", "/reset").json == {"args": []}
    assert shell("service", "node", "--json", "/reset").json == {"node": "/talker"}
    assert list(shell("service", "uri", "--json", "/reset").json) == ["uri"]
    assert list(shell("msg", "md5", "--json", "std_msgs/String").json) == ["std_msgs/String"]
    assert shell("pkg", "find", "--json", "std_msgs").json["name"] == "std_msgs"
