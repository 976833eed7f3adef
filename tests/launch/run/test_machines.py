"""The addresses of machines, the command line of ssh, and its errors."""

from __future__ import annotations

import os
import threading

import pytest

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.launch.plan.model import MachinePlan, NodePlan, Plan
from rosz.launch.run.host import is_local
from rosz.launch.run.machines import (
    MachineOption,
    launch_endpoints,
    move_machines,
    ssh_command,
    ssh_failure,
)
from rosz.launch.run.protocol import AgentWarning, LineReader, MessageWriter

from .in_thread import HERE, TIMEOUT, shell


def machine(**settings: object) -> MachinePlan:
    values: dict[str, object] = {
        "name": "far",
        "address": "robot",
        "env_loader": "",
        "ssh_port": 22,
        "user": "",
        "password": "",
        "timeout": 10.0,
        "assignable": True,
        "place": HERE,
    }
    return MachinePlan(**{**values, **settings})  # type: ignore[arg-type]  # checked by the tests


@pytest.mark.parametrize(
    ("text", "option"),
    [
        ("robot", MachineOption("", "robot")),
        ("root@robot:2222", MachineOption("", "robot", "root", 2222)),
        ("far=robot", MachineOption("far", "robot")),
        ("far=me@[fe80::1]:22", MachineOption("far", "fe80::1", "me", 22)),
        ("10.0.0.7", MachineOption("", "10.0.0.7")),
    ],
)
def test_a_machine_on_a_command_line(text: str, option: MachineOption) -> None:
    assert MachineOption.parse(text) == option


@pytest.mark.parametrize("text", ["", "a b", "robot:port", "-oProxyCommand=evil", "@robot", "x="])
def test_texts_that_are_not_a_machine(text: str) -> None:
    with pytest.raises(UsageError, match=r"expected \[NAME=\]\[USER@\]ADDRESS\[:PORT\]"):
        MachineOption.parse(text)


def test_nodes_move_with_their_machines() -> None:
    node = NodePlan(package="p", type="t", name="n", namespace="/", place=HERE)
    bound = NodePlan(package="p", type="t", name="m", namespace="/", place=HERE, machine="far")
    plan = Plan(nodes=(node, bound, shell("s", "true")), machines=(machine(user="me"),))
    there = move_machines(
        plan, [MachineOption("", "base", "you"), MachineOption("far", "tower", port=23)]
    )
    assert [one.machine for one in there.nodes] == ["base", "far", ""]
    base, far = there.machine("base"), there.machine("far")
    assert base is not None
    assert far is not None
    assert (base.address, base.user, base.ssh_port) == ("base", "you", 22)
    assert (far.address, far.user, far.ssh_port) == ("tower", "me", 23)
    assert move_machines(plan, []) == plan


def test_ssh_asks_no_questions() -> None:
    words = ssh_command(machine(ssh_port=2222, user="me", password="secret"), 30.0)
    assert words[:2] == ["ssh", "-T"]
    assert "BatchMode=yes" in words
    assert words[-6:-1] == ["2222", "-l", "me", "--", "robot"]
    assert words[-1] == "exec sh -l -c 'exec rosz launch --agent'"
    assert "secret" not in " ".join(words)
    loader = ssh_command(machine(env_loader="/a b/env.sh"), 0.5)
    assert loader[-1] == "exec '/a b/env.sh' rosz launch --agent"
    assert "ServerAliveInterval=1" in loader


@pytest.mark.parametrize(
    ("code", "output", "expected"),
    [
        (255, "ssh: connect to host robot port 22: No route to host", "cannot be reached"),
        (255, "kex_exchange_identification: banner\nwhat now", "failed: what now; try: ssh robot"),
        (255, "", "it gave no reason"),
        (127, "sh: 1: exec: rosz: not found", "no rosz on 'robot'"),
        (1, "ModuleNotFoundError: No module named 'zenoh'", "exit code 1: ModuleNotFoundError"),
    ],
)
def test_errors_of_ssh_are_explained(code: int, output: str, expected: str) -> None:
    assert expected in ssh_failure(machine(), code, output)


def test_local_machines() -> None:
    assert is_local(None)
    assert is_local(machine(address="127.0.1.1"))
    assert not is_local(machine(address="localhost", user="somebody-else"))
    assert not is_local(machine(address="192.0.2.1"))
    assert not is_local(machine(address="no.such.host.invalid"))


def test_endpoints_for_other_machines() -> None:
    default = Environment()
    assert launch_endpoints(default) == ("tcp/:7447",)
    settings = Environment(
        rendezvous="unixsock-stream//run/z.sock",
        listen=("tcp/0.0.0.0:9", "tls/10.0.0.1:10"),
        connect=("tcp/base:7447", "tcp/localhost:1"),
    )
    assert launch_endpoints(settings) == ("tcp/:9", "tls/10.0.0.1:10", "tcp/base:7447")


def test_a_blocked_pipe_blocks_nobody() -> None:
    ours, theirs = os.pipe()
    freed = threading.Event()
    writer = MessageWriter(theirs)
    for number in range(3000):
        writer.send(AgentWarning(f"{number} {'x' * 1000}"))
    assert writer.full
    writer.when_free(freed.set)
    lines, seen = LineReader(ours), []
    reader = threading.Thread(target=writer.close, args=(TIMEOUT,))
    reader.start()
    while not lines.ended:
        seen += lines.read()
    reader.join()
    os.close(ours)
    assert freed.is_set()
    assert [int(line.split(b'"')[7].split()[0]) for line in seen] == list(range(3000))
