"""Where machines are, how they are called, and what it means when they are not reached."""

from __future__ import annotations

import os
import threading

import pytest

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.launch.plan.model import MachinePlan, NodePlan, Plan
from rosz.launch.run.host import is_local
from rosz.launch.run.machines import MachineCall, meeting_places, moved
from rosz.launch.run.pipe import Lines, Outbox
from rosz.launch.run.protocol import Notice
from rosz.launch.run.ssh import ssh_command, ssh_failure

from .scene import HERE, shell


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
    ("text", "call"),
    [
        ("robot", MachineCall("", "robot")),
        ("root@robot:2222", MachineCall("", "robot", "root", 2222)),
        ("far=robot", MachineCall("far", "robot")),
        ("far=me@[fe80::1]:22", MachineCall("far", "fe80::1", "me", 22)),
        ("10.0.0.7", MachineCall("", "10.0.0.7")),
    ],
)
def test_a_machine_on_a_command_line(text: str, call: MachineCall) -> None:
    assert MachineCall.parse(text) == call


@pytest.mark.parametrize("text", ["", "a b", "robot:port", "-oProxyCommand=evil", "@robot", "x="])
def test_what_is_no_machine(text: str) -> None:
    with pytest.raises(UsageError, match=r"expected \[NAME=\]\[USER@\]ADDRESS\[:PORT\]"):
        MachineCall.parse(text)


def test_nodes_move_with_their_machines() -> None:
    node = NodePlan(package="p", type="t", name="n", namespace="/", place=HERE)
    bound = NodePlan(package="p", type="t", name="m", namespace="/", place=HERE, machine="far")
    plan = Plan(nodes=(node, bound, shell("s", "true")), machines=(machine(user="me"),))
    there = moved(plan, [MachineCall("", "base", "you"), MachineCall("far", "tower", port=23)])
    assert [one.machine for one in there.nodes] == ["base", "far", ""]
    base, far = there.machine("base"), there.machine("far")
    assert base is not None
    assert far is not None
    assert (base.address, base.user, base.ssh_port) == ("base", "you", 22)
    assert (far.address, far.user, far.ssh_port) == ("tower", "me", 23)
    assert moved(plan, []) == plan


def test_ssh_is_called_so_that_nothing_is_asked() -> None:
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
    ("code", "said", "told"),
    [
        (255, "ssh: connect to host robot port 22: No route to host", "cannot be reached"),
        (255, "kex_exchange_identification: banner\nwhat now", "failed: what now; try: ssh robot"),
        (255, "", "it gave no reason"),
        (127, "sh: 1: exec: rosz: not found", "no rosz on 'robot'"),
        (1, "ModuleNotFoundError: No module named 'zenoh'", "exit code 1: ModuleNotFoundError"),
    ],
)
def test_what_ssh_means(code: int, said: str, told: str) -> None:
    assert told in ssh_failure(machine(), code, said)


def test_who_is_here() -> None:
    assert is_local(None)
    assert is_local(machine(address="127.0.1.1"))
    assert not is_local(machine(address="localhost", user="somebody-else"))
    assert not is_local(machine(address="192.0.2.1"))
    assert not is_local(machine(address="no.such.host.invalid"))


def test_where_others_find_a_launch() -> None:
    default = Environment()
    assert meeting_places(default) == ("tcp/:7447",)
    settings = Environment(
        rendezvous="unixsock-stream//run/z.sock",
        listen=("tcp/0.0.0.0:9", "tls/10.0.0.1:10"),
        connect=("tcp/base:7447", "tcp/localhost:1"),
    )
    assert meeting_places(settings) == ("tcp/:9", "tls/10.0.0.1:10", "tcp/base:7447")


def test_a_pipe_that_nobody_reads_holds_up_nobody() -> None:
    ours, theirs = os.pipe()
    freed = threading.Event()
    outbox = Outbox(theirs, freed.set)
    for number in range(3000):
        outbox.send(Notice(f"{number} {'x' * 1000}"))
    assert outbox.full
    lines, seen = Lines(ours), []
    reader = threading.Thread(target=outbox.close, args=(10,))
    reader.start()
    while not lines.ended:
        seen += lines.read()
    reader.join()
    os.close(ours)
    assert freed.is_set()
    assert [int(line.split(b'"')[7].split()[0]) for line in seen] == list(range(3000))
