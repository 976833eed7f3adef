"""A network with a router or without one, and nodes of hiroz on it."""

from __future__ import annotations

import itertools
import json
import re
import socket
from collections import Counter
from contextlib import suppress
from typing import Any

from cached import hiroz_peer, zenohd
from network import TIMEOUT, Network, Program, eventually, free_port

from rosz.node import Context, Node
from rosz.session import Router

__all__ = ("ROUTED", "WAYS", "City", "Peer")

ROUTED = ("core-peer", "core-client", "hiroz-peer", "zenohd-peer")
"""The router that the sessions meet at, and how hiroz is linked to it."""
WAYS = (*ROUTED, "none-peer")
"""The same, and without a router. Then a session of rmw_zenoh is linked to the one at the meeting
point only: it does not tell other peers where it listens."""
_domains = itertools.count(50)


class Peer:
    """A node of hiroz: a process that obeys lines, and prints what happens.

    Args:
        program: The process.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        self.zid = program.wait_for("ready").split()[1]
        self._seen: Counter[str] = Counter()

    def tell(self, *words: object) -> None:
        """Give it a command."""
        self.program.say(" ".join(map(str, words)))

    def do(self, *words: object) -> None:
        """Give it a command, and wait until that is done."""
        self.tell(*words)
        self.next(f"done {words[0]}")

    def next(self, event: str, timeout: float = TIMEOUT) -> Any:
        """Wait for the next line that tells of an event, and return its value.

        Args:
            event: The verb of the line, and the name after it, as a regular expression.
            timeout: Time limit in seconds.
        """
        self._seen[event] += 1
        pattern = re.compile(f"^{event} |^error ")
        line = self.program.wait_for(pattern, timeout, times=self._seen[event])
        assert not line.startswith("error"), line
        return json.loads(line.split(" ", 2)[2])

    def ask(self, event: str, *words: object) -> Any:
        """Give it a command, and return the value of the event that follows."""
        self.tell(*words)
        return self.next(event)

    def snapshot(self) -> dict[str, list[dict[str, Any]]]:
        """Return its view of the graph."""
        view: dict[str, Any] = self.ask("graph", "graph")["snapshot"]
        return view

    def nodes(self) -> set[str]:
        """Return the base names of all nodes in its view."""
        return {node["name"] for node in self.snapshot()["nodes"]}

    def wait_for_service(self, name: str) -> None:
        """Wait until a service is in its view."""

        def is_there() -> bool:
            return any(row["name"] == name for row in self.snapshot()["services"])

        eventually(is_there, f"'{name}' in the graph of hiroz")

    def wait_for_subscription(self, topic: str) -> None:
        """Wait until a subscription of a topic is in its view."""

        def is_there() -> bool:
            topics = self.snapshot()["topics"]
            return any(row["name"] == topic and row["subscribers"] for row in topics)

        eventually(is_there, f"a subscription of '{topic}' in the graph of hiroz")


class City(Network):
    """A network of one test, perhaps around a router.

    Args:
        way: One of `WAYS`.
    """

    def __init__(self, way: str) -> None:
        super().__init__(next(_domains))
        self.program_of_hiroz = str(hiroz_peer())
        self.rendezvous = f"tcp/127.0.0.1:{free_port()}"
        self.router, self.mode = way.split("-")
        self._holder: Context | None = None

    def begin(self) -> None:
        """Start what the sessions meet at."""
        if self.router == "core":
            self._keep(Router(self.environment()))
        elif self.router == "hiroz":
            self.execute(self.program_of_hiroz, "router", self.rendezvous).wait_for("ready")
        elif self.router == "zenohd":
            self.execute(str(zenohd()), "--listen", self.rendezvous, "--no-multicast-scouting")
            eventually(self._is_open, "zenohd")
        else:
            self._holder = self.context()

    def _is_open(self) -> bool:
        host, _, port = self.rendezvous.partition("/")[2].partition(":")
        with suppress(OSError), socket.create_connection((host, int(port))):
            return True
        return False

    def node(self, name: str = "node", **options: Any) -> Node:
        """Return a node, on a session of its own if there is a router."""
        if self._holder is not None:
            options["context"] = self._holder
        return super().node(name, **options)

    def peer(self, name: str = "/partner", **variables: str) -> Peer:
        """Start a node of hiroz."""
        words = (self.mode, self.rendezvous, name)
        return Peer(self.execute(self.program_of_hiroz, *words, **variables))
