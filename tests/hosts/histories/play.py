"""Playing a history, and what has to hold after it."""

from __future__ import annotations

import json
import signal
import time
from typing import Any, NamedTuple

from network import TIMEOUT

from hosts.histories.history import Action, History
from hosts.host import Host, HostProgram
from hosts.world import World

__all__ = ("Result", "play")

_PATIENCE = 60.0
"""Seconds after which what has not come together never does."""
_STEADY = 3.0
"""Seconds that all have to stay together."""

_NODE = """
import json, sys, threading, time, zlib
import rosz
from rosz.msgs.std_msgs.msg import String

name = sys.argv[1]
heard = {}
writing = True
with rosz.Node(name) as node:
    replica = node.context.params
    beat = node.publisher("beat", String, queue_size=10)
    node.subscription("beat", String, lambda text: heard.update({text.data: time.monotonic()}))

    def publish():
        for _ in node.rate(5):
            beat.publish(String(data=name))

    def write():
        count = 0
        while writing:
            count += 1
            outcome = replica.set(f"/w/{name}/{count}", count)
            print("set", count, len(outcome.slow), len(replica.members()), flush=True)
            time.sleep(0.2)
        print("quiet", flush=True)

    threading.Thread(target=publish, daemon=True).start()
    threading.Thread(target=write, daemon=True).start()
    for line in sys.stdin:
        if line.strip() == "quiet":
            writing = False
            continue
        now = time.monotonic()
        found = {
            "nodes": sorted(node.context.graph.view().nodes()),
            "replicas": len(replica.members()) + 1,
            "heard": sorted("/" + who for who, at in heard.items() if now - at < 2),
            "digest": zlib.crc32(replica.digest()),
        }
        if line.strip() == "root":
            found = replica.root.get("w", {})
        print("found", json.dumps(found), flush=True)
"""


class Result(NamedTuple):
    """What became of a history.

    Attributes:
        seconds: Time from the last action until all agree; None if they never do.
        written: Number of acknowledged writes.
        lost: Those of them that somebody lacks in the end.
        views: What each node knows in the end, if they do not agree.
        restarts: Reasons of cores that started afresh.
    """

    seconds: float | None
    written: int
    lost: list[str]
    views: dict[str, Any]
    restarts: list[str]

    @property
    def good(self) -> bool:
        """Whether all came together and nothing was lost."""
        return self.seconds is not None and not self.lost


class _Machine:
    """A host with its core and its node."""

    def __init__(self, host: Host, neighbours: str) -> None:
        self.host = host
        self._connect = [f"--connect=tcp/{other}:7447" for other in neighbours]
        self._generation = 0
        self.acknowledged: list[str] = []
        self.start("core")
        self.start("node")

    def start(self, what: str) -> None:
        if what == "core":
            self.core = self.host.rosz(
                "core",
                "--listen=tcp/0.0.0.0:7447",
                f"--store={self.host.home}/params.db",
                *self._connect,
                ZENOH_CONFIG_OVERRIDE="connect/timeout_ms=-1",
            )
            self.core.wait_for("started core")
            return
        self._generation += 1
        self.name = f"{self.host.name}{self._generation}"
        self.node = self.host.program(_NODE, self.name)

    def program(self, what: str) -> HostProgram:
        return self.core if what == "core" else self.node

    def do(self, action: Action) -> None:
        """Let something happen here."""
        if action.verb == "cut":
            self.host.link.cut()
        elif action.verb == "heal":
            self.host.link.heal()
        elif action.verb == "stop":
            self.program(action.what).send(signal.SIGSTOP)
        elif action.verb == "resume":
            self.program(action.what).send(signal.SIGCONT)
        elif action.verb == "end":
            self.node.send(signal.SIGTERM)
            assert self.node.process.stdin is not None
            self.node.process.stdin.close()  # which the program waits for
            self.node.exit_code()
            self.collect(live="is lost with this process" not in self.node.output)
        elif action.verb == "kill":
            self.program(action.what).kill()
            if action.what == "node":
                self.collect(live=False)
        else:
            self.start(action.what)

    def collect(self, *, live: bool) -> None:
        """Note what the node has written, and who has it.

        A write may be lost together with its writer if some replica did not acknowledge it, or if
        there was no other; a writer that is told to end hands such writes over, or says what is
        lost.
        """
        for line in self.node.lines:
            word, *rest = line.split()
            if word == "set" and (live or (rest[1] == "0" and rest[2] != "0")):
                self.acknowledged.append(f"{self.name}/{rest[0]}")

    def quiet(self) -> None:
        self.node.say("quiet")
        self.node.wait_for("quiet", 2 * TIMEOUT)

    def ask(self, what: str) -> Any:
        before = len(self.node.lines)
        self.node.say(what)
        return json.loads(self.node.wait_for("found ", TIMEOUT, after=before)[6:])


def play(history: History) -> Result:
    """Play a history."""
    with World() as world:
        hosts = world.hosts(*history.neighbours)
        machines = {host.name: _Machine(host, history.neighbours[host.name]) for host in hosts}
        for machine in machines.values():
            machine.node.wait_for("set ")
        began = time.monotonic()
        for action in history.actions:
            time.sleep(max(0.0, began + action.time - time.monotonic()))
            machines[action.host].do(action)
        return _result(list(machines.values()), time.monotonic())


def _result(machines: list[_Machine], healed: float) -> Result:
    for machine in machines:
        machine.quiet()
        machine.collect(live=True)
    names = sorted(f"/{machine.name}" for machine in machines)
    since: float | None = None
    while True:
        views = {machine.name: machine.ask("view") for machine in machines}
        together = len({view["digest"] for view in views.values()}) == 1 and all(
            view["nodes"] == view["heard"] == names and view["replicas"] == 2 * len(names)
            for view in views.values()
        )
        now = time.monotonic()
        since = (since or now) if together else None
        if (since is not None and now - since > _STEADY) or now - healed > _PATIENCE:
            break
        time.sleep(0.1)
    acknowledged = [write for machine in machines for write in machine.acknowledged]
    roots = [machine.ask("root") for machine in machines]
    lost = [write for write in acknowledged if not all(_has(root, write) for root in roots)]
    restarts = [
        f"{machine.host.name}: {line.partition(',')[0]}"
        for machine in machines
        for line in machine.core.lines
        if "started afresh" in line
    ]
    took = None if since is None else since - healed
    return Result(took, len(acknowledged), lost, {} if took else views, restarts)


def _has(root: dict[str, Any], write: str) -> bool:
    name, _, count = write.partition("/")
    return bool(root.get(name, {}).get(count) == int(count))
