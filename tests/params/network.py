"""The network of a test, with replicas of the parameter store on it."""

from __future__ import annotations

import threading
from typing import Any

import network
from network import TIMEOUT

from rosz.lifecycle import Closable
from rosz.params import condense, normalise, spread
from rosz.params.replica import Outcome, ParamClient, Replica
from rosz.session import MeshReadiness, Session, SessionConfig, serve_links


def merge(store: Replica | ParamClient, name: str, value: Any, **how: Any) -> Outcome:
    """Set a name as ROS 1's command line does: a dict leaf by leaf, as one change."""
    return store.write(condense(spread(name, normalise(value, name))), **how)


class Network(network.Network):
    """A network whose sessions are linked to all before them, with replicas of domain 0."""

    def __init__(self) -> None:
        super().__init__(domain=0)
        self._linked = 0

    def session(self, config: SessionConfig | None = None) -> Session:
        """Return a session that is linked to all before it."""
        session = super().session(config or SessionConfig(rendezvous=self.rendezvous))
        self._keep(serve_links(session))
        if self._linked:
            assert MeshReadiness(session, TIMEOUT, threading.Event()).ready.wait(TIMEOUT)
        self._linked += 1
        return session

    def command(self) -> Session:
        """Return a session as commands have it: a client of whoever is at the rendezvous."""
        return super().session(
            SessionConfig(mode="client", rendezvous=self.rendezvous, must_connect=True)
        )

    def replica(self, domain: int = 0, **settings: Any) -> Replica:
        """Return a replica on a session of its own."""
        return self.join(self.session(), domain, **settings)

    def join(self, session: Session, domain: int = 0, **settings: Any) -> Replica:
        """Return a replica on a session."""
        return self._keep(Replica(session, domain, **settings))

    def replicas(self, count: int) -> list[Replica]:
        """Return replicas that all know each other."""
        found = [self.replica(label=f"r{index}") for index in range(count)]
        network.eventually(lambda: all(len(replica.members()) == count - 1 for replica in found))
        return found

    def keep(self, thing: Closable) -> None:
        """Close something at the end of the test."""
        self._keep(thing)
