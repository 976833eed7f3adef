"""Large messages between machines: late rather than never, and at nobody else's cost."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from network import eventually

from hosts.host import Host, HostProgram
from hosts.scripts import p95, slack
from hosts.world import World

TALKER = """
import sys, threading, time
import rosz
from rosz.msgs.std_msgs.msg import Float64, UInt8MultiArray

size = int(sys.argv[1])
with rosz.Node("talker") as node:
    latch, unlimited = "latch" in sys.argv, "unlimited" in sys.argv
    large = node.publisher(
        "large", UInt8MultiArray, latch=latch, queue_size=0 if unlimited else 10
    )
    small = node.publisher("small", Float64)
    node.timer(0.02, lambda event: small.publish(time.time()))
    print("talking", flush=True)
    for line in sys.stdin:
        subscribers, first, last, pause = line.split()
        large.wait_for_subscribers(int(subscribers), timeout=60)
        longest = 0.0
        for number in range(int(first), int(last)):
            began = time.monotonic()
            large.publish(data=bytes([number]) * size)
            longest = max(longest, time.monotonic() - began)
            time.sleep(float(pause))
        print(f"longest {longest:.3f} dropped {large.dropped}", flush=True)
"""
"""Publishes large messages as it is told: ``SUBSCRIBERS FIRST LAST PAUSE``; and small ones."""

LISTENER = """
import sys, time
import rosz
from rosz.msgs.std_msgs.msg import Float64, UInt8MultiArray

delays = []
with rosz.Node(sys.argv[1]) as node:
    node.subscription(
        "large",
        UInt8MultiArray,
        lambda m, info: print(f"large {m.data[0]} lost {info.lost}", flush=True),
        with_info=True,
        queue_size=100,
    )
    node.subscription("small", Float64, lambda m: delays.append(time.time() - m.data))
    print("ready", flush=True)
    sys.stdin.readline()
    print("delays", *(f"{delay:.4f}" for delay in delays), flush=True)
"""
"""Prints what it hears on ``large``, and at last how late the small messages were."""

_BYTES_PER_SECOND = 2_000_000
PATIENT = "transport/link/tx/lease=3600000"
"""Others keep the link of a process that is stopped for as long as the test takes."""
LISTEN = "tcp/0.0.0.0:7447"


@pytest.fixture(autouse=True)
def slow_links() -> None:
    if not Path("/dev/net/tun").exists():
        pytest.skip("slow links need /dev/net/tun")


def link(robot: Host, *others: Host, linked: str) -> None:
    """Link machines by a ``core`` on each, or by the ``nodes`` of all but the robot."""
    robot.rosz("core", "--listen", LISTEN).wait_for("started core")
    for other in others:
        if linked == "core":
            other.rosz("core", "--connect", "tcp/robot:7447").wait_for("started core")
        else:
            other.variables["ROSZ_CONNECT"] = "tcp/robot:7447"


def listen(host: Host, name: str, **variables: str) -> HostProgram:
    listener = host.program(LISTENER, name, **variables)
    listener.wait_for("ready")
    return listener


def heard(listener: HostProgram) -> list[int]:
    return [int(line.split()[1]) for line in listener.lines if line.startswith("large")]


def lost(listener: HostProgram) -> int:
    return sum(int(line.split()[3]) for line in listener.lines if line.startswith("large"))


@pytest.mark.parametrize(
    ("linked", "queue"), [("core", "limited"), ("nodes", "limited"), ("core", "unlimited")]
)
def test_all_arrive_over_a_slow_link(world: World, linked: str, queue: str) -> None:
    """Small messages pass between the pieces."""
    robot, laptop = world.hosts("robot", "laptop")
    link(robot, laptop, linked=linked)
    listener = listen(laptop, "listener")
    talker = robot.program(TALKER, "2000000", queue)
    talker.wait_for("talking")
    laptop.link.degrade(rate=_BYTES_PER_SECOND)
    talker.say("1 0 4 0")
    assert float(talker.wait_for("longest").split()[1]) < 0.5 * slack()
    listener.wait_for("large 3", 60)
    assert heard(listener) == [0, 1, 2, 3]
    assert lost(listener) == 0
    listener.say("")
    delays = sorted(map(float, listener.wait_for("delays").split()[1:]))
    print(f"small messages beside large ones, {linked}: p95 {p95(delays):.3f} s")
    assert p95(delays) < 0.25 * slack()


def test_a_latched_one_arrives_over_a_slow_link(world: World) -> None:
    """It is published as well, so that the cache for late subscriptions has it."""
    robot, laptop = world.hosts("robot", "laptop")
    link(robot, laptop, linked="core")
    listener = listen(laptop, "listener")
    talker = robot.program(TALKER, "2000000", "latch")
    talker.wait_for("talking")
    laptop.link.degrade(rate=_BYTES_PER_SECOND)
    for number in range(2):
        talker.say(f"1 {number} {number + 1} 0")
        listener.wait_for(f"large {number}", 60)
    laptop.link.heal()
    late = listen(laptop, "late")
    late.wait_for("large 1", 60)
    assert heard(listener) == [0, 1]
    assert heard(late) == [1]


def test_a_slow_link_is_nobody_elses_problem(world: World) -> None:
    """What it cannot carry is dropped for it alone, and told on both sides."""
    robot, laptop, other = world.hosts("robot", "laptop", "other")
    link(robot, laptop, other, linked="core")
    slow, fast, near = listen(laptop, "slow"), listen(other, "fast"), listen(robot, "near")
    talker = robot.program(TALKER, "300000")
    talker.wait_for("talking")
    laptop.link.degrade(rate=_BYTES_PER_SECOND / 32)  # 5 s for each, on any machine
    count = 40
    for number in range(count):  # each when the others have the one before
        talker.say(f"3 {number} {number + 1} 0")
        told = talker.wait_for("longest", 60, after=number + 1).split()
        assert float(told[1]) < 0.5 * slack()
        for listener in (fast, near):
            listener.wait_for(f"large {number}", 60)
    for listener in (fast, near):
        assert heard(listener) == [*range(count)]
    laptop.link.heal()  # what waits still comes
    slow.wait_for(f"large {count - 1}", 60)
    talker.say("0 0 0 0")  # the last ones were dropped after they were published
    dropped = int(talker.wait_for("longest", after=count + 1).split()[3])
    assert dropped > 0
    assert heard(slow) == sorted(heard(slow))
    assert len(heard(slow)) >= 10  # the queue of the publisher
    assert lost(slow) == dropped == count - len(heard(slow))
    for program, what in ((talker, "for node '/slow'"), (slow, "come faster than")):
        (warning,) = [
            line for line in program.output.splitlines() if "dropping messages on '/large'" in line
        ]
        assert what in warning
        assert "queue_size=" in warning
    info = other.ask("topic", "info", "/large")
    assert [line.rpartition(", ")[2] for line in info.splitlines() if "dropped" in line] == [
        f"{dropped} dropped"
    ] * 2


def test_a_stopped_subscription_holds_nobody_up(world: World) -> None:
    """It gets what the queue of the publisher still has when it goes on."""
    robot, laptop, other = world.hosts("robot", "laptop", "other")
    link(robot, laptop, other, linked="nodes")
    stopped = listen(laptop, "stopped", ZENOH_CONFIG_OVERRIDE=PATIENT)
    running = listen(other, "running")
    talker = robot.program(TALKER, "1000000")
    talker.wait_for("talking")
    talker.say("2 0 1 0")
    stopped.wait_for("large 0")
    stopped.send(signal.SIGSTOP)
    # Each when the one before has arrived: the queue of the publisher has room for the running one.
    for number in range(1, 31):
        talker.say(f"1 {number} {number + 1} 0")
        line = talker.wait_for("longest", 60, after=number + 1)
        assert float(line.split()[1]) < 0.5 * slack()
        running.wait_for(f"large {number}", 60)
    assert heard(running) == [*range(31)]
    stopped.send(signal.SIGCONT)
    stopped.wait_for("large 30", 60)
    assert heard(stopped)[-10:] == [*range(21, 31)]


def test_a_cut_link_only_delays(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    link(robot, laptop, linked="core")
    listener = listen(laptop, "listener")
    talker = robot.program(TALKER, "2000000")
    talker.wait_for("talking")
    laptop.link.degrade(rate=_BYTES_PER_SECOND)
    talker.say("1 0 4 0")
    listener.wait_for("large 0", 60)
    laptop.link.cut()
    eventually(lambda: not laptop.lists("/talker"), "the cut is noticed", 60)
    laptop.link.heal()
    listener.wait_for("large 3", 60)
    assert heard(listener) == [0, 1, 2, 3]


def test_published_by_a_program_that_ends(world: World) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    link(robot, laptop, linked="core")
    listener = listen(laptop, "listener")
    laptop.link.degrade(rate=_BYTES_PER_SECOND)
    talker = robot.program(TALKER, "500000")
    talker.wait_for("talking")
    talker.say("1 0 2 0")
    talker.wait_for("longest")
    talker.send(signal.SIGINT)
    talker.exit_code()
    assert "closed '/large'" not in talker.output
    listener.wait_for("large 1", 60)
    assert heard(listener) == [0, 1]
