"""Links that are cut, healed and bad, routers that die, a subscriber that stops."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest
from network import eventually, repeats

from hosts.host import Host, HostProgram
from hosts.scripts import COUNTER, LISTENER, TALKER, slack
from hosts.world import World

LISTEN = "tcp/0.0.0.0:7447"
AGAIN_BY = 5.0
"""Seconds after which all is as it was when a link has been healed."""
_LEASE = 6.0
"""Seconds after the last message of a link at which Zenoh gives it up, where a test says so. TCP by
itself tries again 3 s after a cut, and then after 6.2 s and 12.6 s."""
_KEEP_ALIVE = _LEASE / 4 + 0.1
"""Seconds in which such a link that carries nothing else carries a message of Zenoh each way."""


def start_core(host: Host, *options: str) -> HostProgram:
    core = host.rosz("core", *options)
    core.wait_for("started core")
    return core


class Pair:
    """Two machines with a talker, a listener, and two who count with parameters.

    Args:
        world: Where.
        linked: How the laptop is linked: by a ``core`` of its own, or by each of its ``nodes``.
        variables: Environment of all programs.
    """

    def __init__(self, world: World, linked: str, **variables: str) -> None:
        self.robot, self.laptop = world.hosts("robot", "laptop")
        for host in (self.robot, self.laptop):
            host.variables |= variables
        self.core = start_core(self.robot, "--listen", LISTEN)
        if linked == "core":
            start_core(self.laptop, "--connect", "tcp/robot:7447")
        else:
            self.laptop.variables["ROSZ_CONNECT"] = "tcp/robot:7447"
        self.robot.program(TALKER).wait_for("talking")
        self.here = self.robot.program(COUNTER, "here")
        self.there = self.laptop.program(COUNTER, "there")
        for counter in (self.here, self.there):
            counter.wait_for("ready")
        self.laptop.program(TALKER, "back", "other").wait_for("talking")
        self.listener = self.laptop.program(LISTENER)
        self.listener.wait_for("heard")
        self.names = sorted(["/talker", "/here", "/there", "/back", "/listener"])

    def hears_again(self, within: float, since: float) -> float:
        """Return how long after a moment the listener heard something new."""
        self.listener.wait_for("heard", within, after=len(self.listener.lines))
        return time.monotonic() - since

    def agree(self, within: float, since: float, **expected: int) -> float:
        """Return how long after a moment both sides have the same parameters."""

        def equal() -> bool:
            sides = [{n: get(counter, n) for n in expected} for counter in (self.here, self.there)]
            return sides[0] == sides[1] == {n: str(value) for n, value in expected.items()}

        eventually(equal, "the same parameters on both sides", within)
        return time.monotonic() - since

    def same_graph(self, within: float, since: float) -> float:
        """Return how long after a moment both sides list all nodes."""

        def complete() -> bool:
            # A command fails where a link is not known to be back yet.
            commands = [host.rosz("node", "list") for host in (self.robot, self.laptop)]
            return all(
                one.exit_code() == 0 and one.output.split() == self.names for one in commands
            )

        eventually(complete, "all nodes on both sides", within)
        return time.monotonic() - since


def get(counter: HostProgram, name: str) -> str:
    """Return what a counter finds at ``/name``."""
    before = len(counter.lines)
    counter.say(f"/{name}")
    return counter.wait_for(f"/{name} ", after=before).split()[-1]


def set_both(pair: Pair) -> None:
    """Write on both sides, as far as they are from each other."""
    for counter, line in (
        (pair.here, "/mine=1"),
        (pair.there, "/yours=2"),
        (pair.there, "/same=3"),
    ):
        before = len(counter.lines)
        counter.say(line)
        counter.wait_for(f"{line.partition('=')[0]} ", after=before)


CUTS = [3, 6, 9, 12, 20, 60] if repeats(0, 1) else [10]
"""Seconds: before TCP is slow to try again, before and after a link counts as lost, and long."""


@pytest.mark.parametrize("linked", ["core", "nodes"])
@pytest.mark.parametrize("seconds", CUTS)
def test_a_link_is_cut_and_healed(world: World, linked: str, seconds: float) -> None:
    pair = Pair(world, linked)
    began = time.monotonic()
    pair.laptop.link.cut()
    set_both(pair)
    heard = pair.listener.output.count("heard")
    time.sleep(max(0.0, began + seconds - time.monotonic()))
    assert pair.listener.output.count("heard") == heard
    healed = time.monotonic()
    pair.laptop.link.heal()
    topics = pair.hears_again(100, healed)
    params = pair.agree(100, healed, mine=1, yours=2, same=3)
    graph = pair.same_graph(100, healed)
    print(
        f"link cut for {seconds} s, linked by {linked}: topics after {topics:.2f} s, parameters"
        f" after {params:.2f} s, graph after {graph:.2f} s"
    )
    assert topics < AGAIN_BY * slack()
    assert params < AGAIN_BY * slack()
    assert graph < (AGAIN_BY + 3) * slack()  # the commands that look take their time


@pytest.mark.parametrize("linked", ["core", "nodes"])
def test_a_link_that_was_just_given_up_holds_up_nothing(world: World, linked: str) -> None:
    """Its connection has things to send still, which is no reason to wait for it."""
    pair = Pair(world, linked, ZENOH_CONFIG_OVERRIDE=f"transport/link/tx/lease={_LEASE * 1000:g}")
    seconds = []
    for number in range(repeats(1, 10)):
        if number:
            time.sleep(_KEEP_ALIVE)  # each side hears the other, so that the next cut is a new one
        pair.laptop.link.cut()
        time.sleep(_LEASE + 0.6)
        healed = time.monotonic()
        pair.laptop.link.heal()
        seconds.append(pair.hears_again(100, healed))
    print(f"link cut and given up, linked by {linked}: topics after {max(seconds):.2f} s at most")
    assert max(seconds) < 3 * slack()


def test_a_bad_link(world: World) -> None:
    if not Path("/dev/net/tun").exists():
        pytest.skip("bad links need /dev/net/tun")
    pair = Pair(world, "core")
    pair.laptop.link.degrade(delay=0.1, loss=0.3)  # each way
    began = time.monotonic()
    set_both(pair)
    print(
        f"30 % loss, 200 ms there and back: parameters agree after"
        f" {pair.agree(60, began, mine=1, yours=2, same=3):.2f} s"
    )
    count = len(pair.listener.lines)
    seconds = [pair.hears_again(60, time.monotonic()) for _ in range(50)]
    print(f"messages went on: {len(pair.listener.lines) - count}, longest gap {max(seconds):.2f} s")
    healed = time.monotonic()
    pair.laptop.link.heal()
    print(f"healed: topics after {pair.hears_again(100, healed):.2f} s")
    pair.same_graph(100, healed)


@pytest.mark.parametrize("linked", ["core", "nodes"])
def test_the_router_is_killed_and_started_again(world: World, linked: str) -> None:
    pair = Pair(world, linked)
    pair.core.kill()
    before = len(pair.listener.lines)
    pair.core = start_core(pair.robot, "--listen", LISTEN)
    began = time.monotonic()
    pair.listener.wait_for("heard", after=before + 5)
    topics = time.monotonic() - began
    set_both(pair)
    params = pair.agree(100, began, mine=1, yours=2, same=3)
    graph = pair.same_graph(100, began)
    print(
        f"router killed and started again, linked by {linked}: topics after {topics:.2f} s,"
        f" parameters after {params:.2f} s, graph after {graph:.2f} s"
    )
    assert topics < AGAIN_BY * slack()


FAST = """
import json, resource, sys, time
import rosz
from rosz.msgs.std_msgs.msg import String
with rosz.Node("fast") as node:
    topic = node.publisher("fast", String, queue_size=10)
    message = String(data="x" * 1000)
    topic.wait_for_subscribers(2, timeout=60)
    print("ready", flush=True)
    for line in sys.stdin:
        count, slowest, total, due = int(line), 0.0, 0.0, time.perf_counter()
        for _ in range(count):
            began = time.perf_counter()
            topic.publish(message)
            took = time.perf_counter() - began
            slowest, total = max(slowest, took), total + took
            due += 0.001
            time.sleep(max(0.0, due - time.perf_counter()))
        memory = int(open("/proc/self/statm").read().split()[1]) * 4096
        print("sent", json.dumps([total / count, slowest, memory]), flush=True)
"""

EAR = """
import sys, threading, time
import rosz
from rosz.msgs.std_msgs.msg import String
with rosz.Node(sys.argv[1]) as node:
    count = 0
    def hear(message):
        global count
        count += 1
    node.subscription("fast", String, hear, queue_size=30000)  # all of it, on a busy machine too
    print("ready", flush=True)
    for line in sys.stdin:
        print("count", count, flush=True)
"""


def sent(fast: HostProgram, count: int) -> tuple[float, float, int]:
    """Publish at 1 kHz; return mean and worst seconds of a publish, and bytes of memory."""
    import json

    before = len(fast.lines)
    fast.say(str(count))
    mean, worst, memory = json.loads(fast.wait_for("sent", after=before).partition(" ")[2])
    return mean, worst, memory


def counted(ear: HostProgram) -> int:
    before = len(ear.lines)
    ear.say("")
    return int(ear.wait_for("count", after=before).split()[1])


@pytest.mark.parametrize("where", ["same machine", "other machine"])
def test_a_subscriber_stops_while_a_publisher_runs(world: World, where: str) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    start_core(robot, "--listen", LISTEN)
    start_core(laptop, "--connect", "tcp/robot:7447")
    stopped = (robot if where == "same machine" else laptop).program(EAR, "stopped")
    other = robot.program(EAR, "other")
    for ear in (stopped, other):
        ear.wait_for("ready")
    fast = robot.program(FAST)
    fast.wait_for("ready")
    count = repeats(3000, 20000)
    usual, _, before = sent(fast, count)
    heard = counted(other)
    stopped.send(signal.SIGSTOP)
    mean, worst, after = sent(fast, count)
    eventually(lambda: counted(other) - heard >= 0.99 * count, "all that was sent, at the other")
    grown = after - before
    print(
        f"subscriber stopped on the {where}: publish takes {mean * 1e6:.0f} us (before"
        f" {usual * 1e6:.0f} us, worst {worst * 1e3:.1f} ms), memory grew by {grown / 1e6:.1f} MB"
    )
    assert mean < (10 * usual + 0.001) * slack()
    assert grown < 64e6
    stopped.send(signal.SIGCONT)
    heard = counted(stopped)
    sent(fast, 500)
    eventually(lambda: counted(stopped) > heard, "more, at the one that goes on")
