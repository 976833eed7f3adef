"""A network of sessions for one test, apart from all others."""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rosz.lifecycle import Closable
from rosz.params.replica import Replica
from rosz.session import MeshReadiness, Session, SessionConfig, serve_links

PATIENCE = 10.0


class Network:
    """Opens sessions that meet at a socket of their own, and closes all in the end."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="rosz")
        self.rendezvous = f"unixsock-stream/{Path(self._folder.name) / 'z'}"
        self.sessions: list[Session] = []
        self._open: list[Closable] = []

    def session(self) -> Session:
        """Open a session, linked to all before it."""
        session = Session.open(SessionConfig(rendezvous=self.rendezvous))
        self._open += [session, serve_links(session)]
        if self.sessions:
            assert MeshReadiness(session, PATIENCE, threading.Event()).ready.wait(PATIENCE)
        self.sessions.append(session)
        return session

    def command(self) -> Session:
        """Open a session as commands do: a client of whoever is at the rendezvous."""
        session = Session.open(
            SessionConfig(mode="client", rendezvous=self.rendezvous, must_connect=True)
        )
        self._open.append(session)
        return session

    def replica(self, domain: int = 0, **settings: Any) -> Replica:
        """Open a session and join the store on it."""
        return self.join(self.session(), domain, **settings)

    def join(self, session: Session, domain: int = 0, **settings: Any) -> Replica:
        """Join the store on a session."""
        replica = Replica(session, domain, **settings)
        self._open.append(replica)
        return replica

    def replicas(self, count: int) -> list[Replica]:
        """Open replicas that all know each other."""
        found = [self.replica(label=f"r{index}") for index in range(count)]
        until(lambda: all(len(replica.members()) == count - 1 for replica in found))
        return found

    def keep(self, thing: Closable) -> None:
        """Have something closed in the end."""
        self._open.append(thing)

    def close(self) -> None:
        """Close everything, the latest first."""
        for thing in reversed(self._open):
            thing.close()
        self._folder.cleanup()


def until(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    """Wait for what has no event of its own."""
    deadline = time.monotonic() + seconds
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, "it did not come to be in time"
        pause.wait(0.002)
