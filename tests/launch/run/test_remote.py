"""The launch's side of an agent, which a script replaces."""

from __future__ import annotations

import io
from pathlib import Path

import msgspec
import pytest

from rosz.launch.plan.model import MachinePlan
from rosz.launch.run.console import Console
from rosz.launch.run.excerpt import Excerpt
from rosz.launch.run.loop import Loop
from rosz.launch.run.protocol import (
    PROTOCOL,
    AgentSetup,
    AgentVersion,
    OutputRead,
    Ready,
    Shown,
    Timeouts,
    rosz_version,
)
from rosz.launch.run.remote import RemoteHost

from .in_thread import HERE

SETUP = AgentSetup(
    run_id="1", tag="t", domain=0, meet=(), silence=30.0, timeouts=Timeouts(), prefixed=False
)
FAR = MachinePlan(
    name="far",
    address="far",
    env_loader="",
    ssh_port=22,
    user="",
    password="",
    timeout=10.0,
    assignable=True,
    place=HERE,
)


def test_a_character_that_arrives_in_two_parts_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = "größe\nend\n".encode()
    said = [
        AgentVersion(PROTOCOL, rosz_version(), "far"),
        Ready("tcp/far:7447"),
        Shown(1, whole[:3]),
        Shown(2, "ü\n".encode()),
        Shown(1, whole[3:]),
    ]
    (tmp_path / "said").write_bytes(b"".join(msgspec.json.encode(one) + b"\n" for one in said))
    script = tmp_path / "ssh"
    script.write_text(f"#!/bin/sh\ncat {tmp_path}/said\ncat > {tmp_path}/heard\n")
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    out, err = io.StringIO(), io.StringIO()
    loop = Loop()
    host = RemoteHost(FAR, "far-0", loop, Console(out, err), SETUP)
    while "end\n" not in out.getvalue():
        loop.step(5.0)
    host.close()
    loop.close()
    assert out.getvalue().endswith("größe\nend\n")
    assert err.getvalue() == "ü\n"


def test_output_is_asked_of_the_agent_until_it_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = Excerpt("some words", (3, 4))
    said = [AgentVersion(PROTOCOL, rosz_version(), "far"), Ready("tcp/far:7447")]
    lines = b"".join(msgspec.json.encode(one) + b"\n" for one in said)
    (tmp_path / "said").write_bytes(lines)
    (tmp_path / "answer").write_bytes(msgspec.json.encode(OutputRead(1, part)) + b"\n")
    script = tmp_path / "ssh"
    script.write_text(
        f"#!/bin/sh\ncat {tmp_path}/said\n"
        f"while read line; do case $line in *read*) cat {tmp_path}/answer; break;; esac; done\n"
        "while read line; do case $line in *read*) exit;; esac; done\n"
    )
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    loop = Loop()
    host = RemoteHost(FAR, "far-0", loop, Console(io.StringIO(), io.StringIO()), SETUP)
    found: list[Excerpt] = []
    for after in (None, (3, 4), (5, 6)):
        had = len(found)
        host.read_output(7, after, found.append)
        while len(found) == had:
            loop.step(5.0)
    host.close()
    loop.close()
    assert found == [part, Excerpt("", (3, 4)), Excerpt("", (5, 6))]
