"""What an acknowledged write of a parameter promises when a whole machine stands still."""

from __future__ import annotations

import json
import signal
import time

import pytest
from network import TIMEOUT, repeats

from hosts.host import HostProgram
from hosts.world import World, why_not

_STOPPED = 11.0
"""Seconds after which others have given up the links of a machine that stands still."""

_NODE = """
import json, sys
import rosz

name = sys.argv[1]
with rosz.Node(name) as node:
    replica = node.context.params
    print("up", flush=True)
    for line in sys.stdin:
        if line.strip() == "root":
            print("found", json.dumps(replica.root.get("w", {})), flush=True)
            continue
        count = 0
        while True:
            count += 1
            outcome = replica.set(f"/w/{name}/{count}", count)
            sure = not outcome.slow and not outcome.alone
            print("set", count, int(sure), flush=True)
"""


@pytest.fixture(autouse=True)
def _namespaces() -> None:
    if reason := why_not():
        pytest.skip(reason)


def sure(program: HostProgram) -> list[str]:
    """Return the numbers of the writes that were acknowledged by all."""
    return [line.split()[1] for line in program.lines if line.endswith(" 1") and "set" in line]


@pytest.mark.parametrize("delay", [0.2, 0.5, 0.9] * repeats(1, 10))
def test_a_machine_that_wakes_acknowledges_nothing_in_silence(delay: float) -> None:
    with World() as world:
        near, far = world.hosts("near", "far")
        cores = [
            host.rosz(
                "core",
                "--listen=tcp/0.0.0.0:7447",
                f"--connect=tcp/{other.name}:7447",
                ZENOH_CONFIG_OVERRIDE="connect/timeout_ms=-1",
            )
            for host, other in ((near, far), (far, near))
        ]
        for core in cores:
            core.wait_for("started core")
        reader = far.program(_NODE, "reader")
        writer, other = (near.program(_NODE, name) for name in ("writer", "other"))
        for program in (reader, writer, other):
            program.wait_for("up")
        writer.say("go")
        writer.wait_for("set 20 1")
        stopped = [cores[0], writer, other]
        for program in stopped:
            program.send(signal.SIGSTOP)
        time.sleep(_STOPPED)
        for program in stopped:
            program.send(signal.SIGCONT)
        time.sleep(delay)
        for program in stopped:
            program.kill()
        reader.say("root")
        held = json.loads(reader.wait_for("found ", TIMEOUT)[6:]).get("writer", {})
        promised = sure(writer)
        lost = [number for number in promised if number not in held]
        print(f"{len(promised)} promised, {len(writer.lines) - len(promised)} not, {lost} lost")
        assert not lost


@pytest.mark.parametrize("number", range(repeats(1, 8)))
def test_a_writer_that_is_ended_takes_nothing_along(number: int) -> None:
    """Of four hosts in a chain the last one writes, loses its link, and its node is ended."""
    with World() as world:
        hosts = world.hosts("a", "b", "c", "d")
        for host, other in zip(hosts, [None, *hosts[:-1]], strict=True):
            connect = [] if other is None else [f"--connect=tcp/{other.name}:7447"]
            listen = "--listen=tcp/0.0.0.0:7447"
            core = host.rosz(
                "core", listen, *connect, ZENOH_CONFIG_OVERRIDE="connect/timeout_ms=-1"
            )
            core.wait_for("started core")
        reader = hosts[0].program(_NODE, "reader")
        reader.wait_for("up")
        writer = hosts[3].program(_NODE, "writer")
        writer.wait_for("up")
        writer.say("go")
        writer.wait_for("set 20 1", TIMEOUT)
        if number % 2:
            hosts[3].link.cut()
        time.sleep(0.5)
        writer.send(signal.SIGTERM)
        writer.process.wait(TIMEOUT)
        if number % 2:
            hosts[3].link.heal()
        promised = sure(writer)
        begun = time.monotonic()
        held: dict[str, int] = {}
        while not held.keys() >= set(promised) and time.monotonic() < begun + TIMEOUT:
            before = len(reader.lines)
            reader.say("root")
            held = json.loads(reader.wait_for("found ", TIMEOUT, after=before)[6:])["writer"]
            time.sleep(0.2)
        lost = set(promised) - held.keys()
        took = time.monotonic() - begun
        print(f"{len(promised)} promised, {lost} lost, together after {took:.1f} s")
        assert not lost
