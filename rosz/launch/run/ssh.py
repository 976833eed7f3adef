"""The system's ssh: how it is called, and what its words mean.

The user's configuration, keys, agent and known hosts count, as in a terminal. Nothing is ever asked
(``BatchMode``), so nobody waits for an answer that a launch cannot give.
"""

from __future__ import annotations

import math
import shlex

from rosz.launch.plan.model import MachinePlan

__all__ = ("ssh_command", "ssh_failure")

_AGENT = "rosz launch --agent"
_SSH_PORT = 22
_SSH_FAILED, _NOT_EXECUTABLE, _NOT_FOUND = 255, 126, 127
_LOST_AFTER = 3


def ssh_command(machine: MachinePlan, silence: float) -> list[str]:
    """Return what starts an agent on a machine.

    Args:
        machine: The machine. Without an env-loader the login shell's settings count.
        silence: Seconds without an answer after which the link counts as dead.
    """
    command = ["ssh", "-T", "-o", "BatchMode=yes"]
    command += ["-o", f"ConnectTimeout={math.ceil(machine.timeout)}"]
    command += ["-o", f"ServerAliveInterval={max(1, math.floor(silence / _LOST_AFTER))}"]
    command += ["-o", f"ServerAliveCountMax={_LOST_AFTER}"]
    if machine.ssh_port != _SSH_PORT:
        command += ["-p", str(machine.ssh_port)]
    if machine.user:
        command += ["-l", machine.user]
    if machine.env_loader:
        there = f"exec {shlex.quote(machine.env_loader)} {_AGENT}"
    else:
        there = f"exec sh -l -c {shlex.quote(f'exec {_AGENT}')}"
    return [*command, "--", machine.address, there]


def ssh_failure(machine: MachinePlan, code: int, said: str) -> str:
    """Explain why there is no agent: what is wrong, and what to do.

    Args:
        machine: The machine.
        code: Exit code of ssh.
        said: What it, and the other machine, wrote.
    """
    address = machine.address
    by_hand = " ".join(
        [
            "ssh",
            *(["-p", str(machine.ssh_port)] if machine.ssh_port != _SSH_PORT else []),
            f"{machine.user}@{address}" if machine.user else address,
        ]
    )
    last = said.strip().splitlines()[-1].strip() if said.strip() else ""
    if code == _SSH_FAILED:
        for words, meaning in _meanings(machine, by_hand):
            if words in said:
                return meaning
        return f"ssh to '{address}' failed: {last or 'it gave no reason'}; try: {by_hand}"
    loader = machine.env_loader
    if loader and code in {_NOT_FOUND, _NOT_EXECUTABLE} and f"{loader}:" in said:
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
            f"'{address}' shows another host key than known_hosts has: if it was set up anew, run:"
            f" ssh-keygen -R {address}; if not, somebody else answers there",
        ),
        (
            "Host key verification failed",
            f"the host key of '{address}' is not known: run '{by_hand}' once, and compare its"
            " fingerprint",
        ),
        (
            "Permission denied",
            f"'{address}' lets {user} not in without a password: run: ssh-copy-id {where}",
        ),
        ("Could not resolve", f"'{address}' is no known host name; see /etc/hosts or the DNS"),
        ("Connection refused", f"no ssh server answers at {place}; is openssh-server running?"),
        ("No route to host", f"'{address}' cannot be reached; is it on, and on this network?"),
        ("timed out", f"'{address}' does not answer within {machine.timeout:g} s"),
    ]
