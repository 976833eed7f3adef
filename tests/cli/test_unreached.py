"""Commands that do not reach a machine that they, or a core, should be linked to."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from network import Network, Program, free_port

from rosz.session import opening

from .shell import Result, Shell

MOST_SECONDS = 2.0
"""Within which a command names a machine that does not answer."""


@pytest.fixture
def far(network: Network) -> str:
    """An endpoint where nobody listens at first."""
    return f"unixsock-stream/{network.folder}/far"


@pytest.fixture
def core(shell: Shell) -> Callable[..., Program]:
    def start(*options: str, **variables: str) -> Program:
        program = shell.start("core", *options, **variables)
        program.wait_for("started core")
        return program

    return start


def finished(program: Program) -> Result:
    code = program.exit_code()
    return Result(code, program.output, program.output)


@pytest.mark.parametrize("command", ["topic", "node", "service"])
def test_a_list_without_the_machine_of_rosz_connect(
    shell: Shell, core: Callable[..., Program], far: str, command: str
) -> None:
    core()
    result = finished(shell.start(command, "list", ROSZ_CONNECT=far))
    assert result.code == 1
    assert f"WARNING: {far} is not reached as ROSZ_CONNECT says" in result.out


def test_what_needs_no_other_machine(shell: Shell, core: Callable[..., Program], far: str) -> None:
    """The parameter store is the same wherever it answers."""
    core()
    result = finished(shell.start("param", "get", "/rosdistro", ROSZ_CONNECT=far))
    assert result.code == 0
    assert "noetic" in result.out
    assert f"WARNING: {far} is not reached" in result.out


def test_one_of_several_endpoints_is_enough(
    shell: Shell, core: Callable[..., Program], network: Network, far: str
) -> None:
    core()
    result = finished(shell.start("topic", "list", ROSZ_CONNECT=f"{far},{network.rendezvous}"))
    assert (result.code, result.out) == (0, "")


def test_a_machine_that_the_core_waits_for(
    shell: Shell, core: Callable[..., Program], far: str
) -> None:
    here = core("--connect", far)
    result = shell("topic", "list")
    assert result.code == 1
    assert f"WARNING: {far} is not reached by " in result.err
    examined = shell("doctor", "--wait", "0.1")
    assert f"is waiting for {far}" in examined.out
    core(ROSZ_RENDEZVOUS=far)
    here.wait_for(f"connected to {far}")
    again = shell("topic", "list")
    assert (again.code, again.err) == (0, "")


@pytest.fixture
def silent() -> Iterator[str]:
    """An endpoint where connections wait for ever, as at a machine that is off."""
    with ExitStack() as stack:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        for _ in range(4):  # more than it has room for
            other = stack.enter_context(socket.socket())
            other.setblocking(False)
            other.connect_ex(server.getsockname())
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"


def test_a_machine_that_is_off_is_named_soon(shell: Shell, silent: str) -> None:
    """The system tries for two minutes: the commands say for how long they do."""
    here = f"tcp/127.0.0.1:{free_port()}"
    result = finished(shell.start("topic", "list", ROSZ_CONNECT=f"{silent},{here}"))
    assert result.code == 1
    seconds = [float(found) for found in re.findall(r"within ([\d.]+) s", result.out)]
    assert 0 < opening._NAMED_SECONDS + min(seconds) <= max(seconds) <= MOST_SECONDS
    assert f"no link to '{silent}': no answer" in result.out
    assert f"no link to '{here}': Connection refused" in result.out


@pytest.mark.parametrize("command", [("topic", "list"), ("run", "rosz_tutorials", "publisher.py")])
def test_an_address_that_says_nothing(shell: Shell, command: tuple[str, ...]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        program = shell.start(*command, ROSZ_CONNECT=endpoint)
        line = program.wait_for("it accepts connections and says nothing")
        assert endpoint in line
        program.close()
