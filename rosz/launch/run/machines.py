"""The machines of a launch: where they are, and bringing all of them up at once."""

from __future__ import annotations

import re
import socket
from collections.abc import Mapping, Sequence
from typing import Self

import msgspec

from rosz.environment import Environment
from rosz.errors import UsageError, near_miss
from rosz.launch.plan.model import MachinePlan, Place, Plan
from rosz.launch.run.console import Console
from rosz.launch.run.loop import Loop
from rosz.launch.run.protocol import Setup
from rosz.launch.run.remote import RemoteHost, await_hosts
from rosz.wire import Endpoint

__all__ = ("MachineCall", "Machines", "meeting_places", "moved")

_CALL = re.compile(
    r"(?:(?P<name>[^=@]+)=)?(?:(?P<user>[^@]+)@)?"
    r"(?P<address>\[[^]]+\]|[^-@:=\s][^@:=\s]*)(?::(?P<port>[0-9]{1,5}))?"
)
_SSH_PORT = 22
_TIMEOUT = 10.0


class MachineCall(msgspec.Struct, frozen=True):
    """Where a machine is, as given on a command line: ``[NAME=][USER@]ADDRESS[:PORT]``.

    Attributes:
        name: What files call it; empty for where all nodes run that name no machine.
        address: Host name or address.
        user: Login name; empty for ssh's own choice.
        port: Port of its ssh server.
    """

    name: str
    address: str
    user: str = ""
    port: int = _SSH_PORT

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read it from a command line.

        Raises:
            UsageError: It is none.
        """
        match = _CALL.fullmatch(text)
        if match is None or text.startswith("-"):
            raise UsageError(f"--machine is '{text}'; expected [NAME=][USER@]ADDRESS[:PORT]")
        return cls(
            name=match["name"] or "",
            address=match["address"].strip("[]"),
            user=match["user"] or "",
            port=int(match["port"] or _SSH_PORT),
        )


def moved(plan: Plan, calls: Sequence[MachineCall]) -> Plan:
    """Return the plan with machines where a command line says they are.

    Raises:
        UsageError: No file declares a machine of that name.
    """
    for call in calls:
        plan = _with_default(plan, call) if not call.name else _with_moved(plan, call)
    return plan


def _with_default(plan: Plan, call: MachineCall) -> Plan:
    """Have all nodes that name no machine run on one."""
    machine = MachinePlan(
        name=call.address,
        address=call.address,
        env_loader="",
        ssh_port=call.port,
        user=call.user,
        password="",
        timeout=_TIMEOUT,
        assignable=True,
        place=Place("--machine"),
    )
    nodes = tuple(
        # An <executable> is a command of this machine, whatever machines there are.
        node
        if node.machine or node.command
        else msgspec.structs.replace(node, machine=machine.name)
        for node in plan.nodes
    )
    others = tuple(other for other in plan.machines if other.name != machine.name)
    return msgspec.structs.replace(plan, nodes=nodes, machines=(*others, machine))


def _with_moved(plan: Plan, call: MachineCall) -> Plan:
    """Have a machine that the files declare be somewhere else."""
    declared = {machine.name: machine for machine in plan.machines}
    known = declared.get(call.name)
    if known is None:
        hint = near_miss(call.name, declared) or f"; they declare {', '.join(declared) or 'none'}"
        raise UsageError(f"--machine: no file declares a machine '{call.name}'{hint}")
    fresh = msgspec.structs.replace(
        known, address=call.address, ssh_port=call.port, user=call.user or known.user
    )
    machines = tuple(fresh if machine is known else machine for machine in plan.machines)
    return msgspec.structs.replace(plan, machines=machines)


def meeting_places(environment: Environment) -> tuple[str, ...]:
    """Return where other machines may find what this one is linked to, best first.

    An endpoint without an address, such as ``tcp/:7447``, is on the machine that asks.
    """
    places = []
    for endpoint in (*environment.listen, environment.rendezvous):
        place = Endpoint(endpoint)
        if not place.is_tcp:
            continue
        if place.is_any_address or place.is_local:
            # Keys are for a name, and seldom for an address.
            names = [socket.gethostname()] if environment.keys is not None else []
            places += [f"{place.protocol}/{name}:{place.port}" for name in (*names, "")]
        else:
            places.append(endpoint)
    places += [place for place in environment.connect if "/localhost" not in place]
    return tuple(dict.fromkeys(places))


class Machines:
    """All other machines of one launch.

    Args:
        loop: Where their answers are awaited.
        console: Where it is said what happens to them.
    """

    def __init__(self, loop: Loop, console: Console) -> None:
        self._loop = loop
        self._console = console
        self._hosts: list[RemoteHost] = []

    def call(self, machines: Mapping[str, MachinePlan], setup: Setup) -> dict[str, RemoteHost]:
        """Start the agents of all machines, and wait until they are there.

        Args:
            machines: The machines by name.
            setup: What the agents have to know.

        Raises:
            LaunchError: One does not come up.
        """
        called = {}
        for number, (name, machine) in enumerate(machines.items()):
            if machine.password:
                self._console.error(
                    f"WARNING: {machine.place}: the password of machine '{name}' is not used: a"
                    " launch file is no place for one; give that machine your key instead, once:"
                    f" ssh-copy-id {f'{machine.user}@' if machine.user else ''}{machine.address}"
                )
            there = msgspec.structs.replace(setup, tag=f"{setup.tag}:at{number}")
            host = RemoteHost(
                machine, f"{machine.address}-{number}", self._loop, self._console, there
            )
            self._hosts.append(host)
            called[name] = host
        await_hosts(self._hosts, self._loop)
        return called

    def close(self) -> None:
        """End all agents with what they run; again is no error."""
        for host in self._hosts:
            host.hang_up()
        for host in self._hosts:
            host.close()
