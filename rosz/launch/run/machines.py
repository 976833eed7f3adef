"""The addresses of other machines, and the system's ssh that reaches them.

The user's ssh configuration, keys, agent and known hosts are used, as in a terminal. ssh never asks
a question (``BatchMode``), because a launch could not answer it.
"""

from __future__ import annotations

import math
import re
import shlex
import socket
from collections.abc import Sequence
from typing import Self

import msgspec

from rosz.environment import Environment
from rosz.errors import UsageError, near_miss
from rosz.launch.plan import MachinePlan, Place, Plan
from rosz.wire import Endpoint

_OPTION = re.compile(
    r"(?:(?P<name>[^=@]+)=)?(?:(?P<user>[^@]+)@)?"
    r"(?P<address>\[[^]]+\]|[^-@:=\s][^@:=\s]*)(?::(?P<port>[0-9]{1,5}))?"
)
_AGENT = "rosz launch --agent"
_SSH_PORT = 22
_SSH_FAILED, _NOT_EXECUTABLE, _NOT_FOUND = 255, 126, 127
_ALIVE_COUNT = 3
_TIMEOUT = 10.0


class MachineOption(msgspec.Struct, frozen=True):
    """The address of a machine from a command line: ``[NAME=][USER@]ADDRESS[:PORT]``.

    Attributes:
        name: Name in the launch files, or "" for the machine of all nodes that name none.
        address: Host name or address.
        user: Login name, or "" for that of ssh.
        port: Port of the ssh server.
    """

    name: str
    address: str
    user: str = ""
    port: int = _SSH_PORT

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the machine that the text of an option describes.

        Raises:
            UsageError: If the text does not have the form above.
        """
        match = _OPTION.fullmatch(text)
        if match is None or text.startswith("-"):
            raise UsageError(f"--machine is '{text}'; expected [NAME=][USER@]ADDRESS[:PORT]")
        return cls(
            name=match["name"] or "",
            address=match["address"].strip("[]"),
            user=match["user"] or "",
            port=int(match["port"] or _SSH_PORT),
        )


def move_machines(plan: Plan, options: Sequence[MachineOption]) -> Plan:
    """Return the plan with the machines of a command line.

    Raises:
        UsageError: If no file declares a machine of that name.
    """
    for option in options:
        plan = _set_address(plan, option) if option.name else _set_default(plan, option)
    return plan


def _set_default(plan: Plan, option: MachineOption) -> Plan:
    """Return the plan with all nodes that name no machine on the given one."""
    machine = MachinePlan(
        name=option.address,
        address=option.address,
        env_loader="",
        ssh_port=option.port,
        user=option.user,
        password="",
        timeout=_TIMEOUT,
        assignable=True,
        place=Place("--machine"),
    )
    nodes = tuple(
        # An <executable> is a command of this machine.
        node
        if node.machine or node.command
        else msgspec.structs.replace(node, machine=machine.name)
        for node in plan.nodes
    )
    others = tuple(other for other in plan.machines if other.name != machine.name)
    return msgspec.structs.replace(plan, nodes=nodes, machines=(*others, machine))


def _set_address(plan: Plan, option: MachineOption) -> Plan:
    """Return the plan with another address for a machine that the files declare."""
    declared = {machine.name: machine for machine in plan.machines}
    before = declared.get(option.name)
    if before is None:
        hint = near_miss(option.name, declared) or f"; they declare {', '.join(declared) or 'none'}"
        raise UsageError(f"--machine: no file declares a machine '{option.name}'{hint}")
    fresh = msgspec.structs.replace(
        before, address=option.address, ssh_port=option.port, user=option.user or before.user
    )
    machines = tuple(fresh if machine is before else machine for machine in plan.machines)
    return msgspec.structs.replace(plan, machines=machines)


def launch_endpoints(environment: Environment) -> tuple[str, ...]:
    """Return the endpoints by which other machines may reach this launch, best first.

    An endpoint without an address, such as ``tcp/:7447``, is on this machine, under the address by
    which the other machine knows it.
    """
    endpoints = []
    for text in (*environment.listen, environment.rendezvous):
        endpoint = Endpoint(text)
        if not endpoint.is_tcp:
            continue
        if endpoint.is_any_address or endpoint.is_local:
            # Certificates are issued for a name, and rarely for an address.
            names = [socket.gethostname()] if environment.keys is not None else []
            endpoints += [f"{endpoint.protocol}/{name}:{endpoint.port}" for name in (*names, "")]
        else:
            endpoints.append(text)
    endpoints += [text for text in environment.connect if "/localhost" not in text]
    return tuple(dict.fromkeys(endpoints))


def ssh_command(machine: MachinePlan, silence: float) -> list[str]:
    """Return the command that starts an agent on a machine.

    Without an env-loader, a login shell sets up the environment. After ``silence`` seconds without
    an answer the connection counts as dead.
    """
    command = ["ssh", "-T", "-o", "BatchMode=yes"]
    command += ["-o", f"ConnectTimeout={math.ceil(machine.timeout)}"]
    command += ["-o", f"ServerAliveInterval={max(1, math.floor(silence / _ALIVE_COUNT))}"]
    command += ["-o", f"ServerAliveCountMax={_ALIVE_COUNT}"]
    if machine.ssh_port != _SSH_PORT:
        command += ["-p", str(machine.ssh_port)]
    if machine.user:
        command += ["-l", machine.user]
    if machine.env_loader:
        there = f"exec {shlex.quote(machine.env_loader)} {_AGENT}"
    else:
        there = f"exec sh -l -c {shlex.quote(f'exec {_AGENT}')}"
    return [*command, "--", machine.address, there]


def ssh_failure(machine: MachinePlan, code: int, output: str) -> str:
    """Return the reason why an agent did not start on a machine, and the remedy."""
    address = machine.address
    by_hand = " ".join(
        [
            "ssh",
            *(["-p", str(machine.ssh_port)] if machine.ssh_port != _SSH_PORT else []),
            f"{machine.user}@{address}" if machine.user else address,
        ]
    )
    last = output.strip().splitlines()[-1].strip() if output.strip() else ""
    if code == _SSH_FAILED:
        for words, meaning in _meanings(machine, by_hand):
            if words in output:
                return meaning
        return f"ssh to '{address}' failed: {last or 'it gave no reason'}; try: {by_hand}"
    loader = machine.env_loader
    if loader and code in {_NOT_FOUND, _NOT_EXECUTABLE} and f"{loader}:" in output:
        return f"env-loader '{loader}' cannot be run on '{address}': {last}"
    if code == _NOT_FOUND:
        return (
            f"no rosz on '{address}': install it there, on the PATH of a login shell, or name a"
            ' script in <machine env-loader="..."> that sets the PATH and ends with: exec "$@"'
        )
    return f"the agent on '{address}' ended with exit code {code}: {last or 'it gave no reason'}"


def _meanings(machine: MachinePlan, by_hand: str) -> list[tuple[str, str]]:
    address = machine.address
    user = f"user '{machine.user}'" if machine.user else "the user"
    where = by_hand.removeprefix("ssh ")
    place = f"{address}:{machine.ssh_port}"
    return [
        (
            "IDENTIFICATION HAS CHANGED",
            f"'{address}' shows another host key than known_hosts has: if it was reinstalled, run:"
            f" ssh-keygen -R {address}; if not, another machine answers there",
        ),
        (
            "Host key verification failed",
            f"the host key of '{address}' is not known: run '{by_hand}' once, and compare its"
            " fingerprint",
        ),
        (
            "Permission denied",
            f"'{address}' does not let {user} in without a password: run: ssh-copy-id {where}",
        ),
        ("Could not resolve", f"'{address}' is not a known host name; see /etc/hosts or the DNS"),
        ("Connection refused", f"no ssh server answers at {place}; is openssh-server running?"),
        ("No route to host", f"'{address}' cannot be reached; is it on, and on this network?"),
        ("timed out", f"'{address}' does not answer within {machine.timeout:g} s"),
    ]
