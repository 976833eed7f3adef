"""Real ssh servers on hosts, and users who may come in."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from hosts.host import Host, HostProgram

__all__ = ("befriend", "install_rosz", "serve_ssh")

_ROOT = Path(__file__).parents[2]
_SSHD = "/usr/sbin/sshd"


def serve_ssh(host: Host) -> HostProgram:
    """Run an ssh server with a host key of its own."""
    if not Path(_SSHD).exists() or shutil.which("ssh") is None:
        pytest.skip("ssh is missing: install openssh-server and openssh-client")
    folder = host.home / ".sshd"
    folder.mkdir(exist_ok=True)
    shadow = folder / "shadow"
    if not shadow.exists():
        shadow.write_text("root:*:19000:0:99999:7:::\n")
        host.run("mount", "--bind", str(shadow), "/etc/shadow")
        host.run("mkdir", "-p", "/run/sshd")
    key = folder / "host_key"
    if not key.exists():
        host.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key))
    config = folder / "config"
    config.write_text(
        f"HostKey {key}\nAuthorizedKeysFile .ssh/authorized_keys\nUsePAM no\nPidFile none\n"
        "PermitRootLogin yes\nPasswordAuthentication no\nKbdInteractiveAuthentication no\n"
        "Subsystem sftp internal-sftp\n"
    )
    server = host.execute(_SSHD, "-D", "-e", "-f", str(config))
    server.wait_for("Server listening on 0.0.0.0")
    return server


def befriend(here: Host, there: Host, *, known: bool = True) -> None:
    """Let the user of one host into another, and tell the first who the other is."""
    key = here.home / ".ssh/id_ed25519"
    if not key.exists():
        here.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key))
    with (there.home / ".ssh/authorized_keys").open("a") as file:
        file.write(key.with_suffix(".pub").read_text())
    if known:
        host_key = (there.home / ".sshd/host_key.pub").read_text()
        with (here.home / ".ssh/known_hosts").open("a") as file:
            file.write(f"{there.name} {host_key}")


def install_rosz(host: Host) -> None:
    """Have ``rosz`` on the PATH of login shells of a host."""
    program = host.home / "bin/rosz"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m rosz "$@"\n')
    program.chmod(0o755)
    (host.home / ".profile").write_text(
        f'export PATH="{program.parent}:$PATH" PYTHONPATH="{_ROOT}" PYTHONWARNINGS=error\n'
    )
