"""One replica as a process of its own, told what to do line by line on stdin.

Run as: python member.py '{"endpoint": …, "mode": …, "connect": […], "skew": …, "file": …}'
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

from rosz.params.replica import Replica
from rosz.params.store import Store
from rosz.session import HybridClock, Session, SessionConfig, Stamp
from rosz.session.settle import Settling, serve_links


class SkewedClock(HybridClock):
    """A clock of a machine that is wrong by so many nanoseconds."""

    def __init__(self, clock_id: str, off: int) -> None:
        super().__init__(clock_id)
        self._off = off
        self._shown = 0
        self._gate = threading.Lock()

    def now(self) -> Stamp:
        with self._gate:
            self._shown = max(self._shown + 1, time.time_ns() + self._off)
            return Stamp(self._shown, super().now().id)

    def observe(self, stamp: Stamp) -> None:
        with self._gate:
            self._shown = max(self._shown, stamp.time)


class Member:
    """The replica, and the verbs that its stdin may use."""

    def __init__(
        self, endpoint: str, mode: Any, connect: list[str], skew: float, file: str
    ) -> None:
        self._session = Session.open(
            SessionConfig(rendezvous=endpoint, mode=mode, connect=tuple(connect))
        )
        if skew:
            self._session.clock = SkewedClock(self._session.zid, int(skew * 1e9))
        settled = None
        if mode == "peer":
            serve_links(self._session)
            settled = Settling(self._session, 0.5, threading.Event()).settled
        keep = Store(Path(file)) if file else None
        begun = time.perf_counter()
        self.replica = Replica(
            self._session, label=f"member {os.getpid()}", settled=settled, keep=keep
        )
        self.joined = time.perf_counter() - begun

    def do(self, verb: str, **arguments: Any) -> Any:
        return getattr(self, f"do_{verb}")(**arguments)

    def do_set(self, name: str, value: Any, timeout: float = 2.0) -> Any:
        begun = time.perf_counter()
        outcome = self.replica.set(name, value, timeout=timeout)
        return {"slow": outcome.slow, "seconds": time.perf_counter() - begun}

    def do_delete(self, name: str) -> Any:
        return self.replica.delete(name).slow

    def do_get(self, name: str) -> Any:
        return self.replica.get(name)

    def do_storm(self, prefix: str, count: int, log: str, timeout: float = 2.0) -> Any:
        """Set so many parameters, and note each in a file once it is acknowledged."""
        begun = time.perf_counter()
        note = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        for number in range(count):
            name = f"{prefix}{number}"
            self.replica.set(name, number, timeout=timeout)
            os.write(note, f"{name}\n".encode())
        os.close(note)
        return time.perf_counter() - begun

    def do_load(self, values: dict[str, Any], namespace: str) -> Any:
        begun = time.perf_counter()
        outcome = self.replica.merge(namespace, values, timeout=20)
        return {"slow": outcome.slow, "seconds": time.perf_counter() - begun}

    def do_state(self) -> Any:
        return {
            "digest": self.replica.digest().hex(),
            "count": len(self.replica.names()),
            "members": len(self.replica.members()),
        }

    def do_root(self) -> Any:
        return self.replica.root

    def do_joined(self) -> Any:
        return self.joined


def main() -> None:
    member = Member(**json.loads(sys.argv[1]))
    print(json.dumps("up"), flush=True)
    for line in sys.stdin:
        verb, arguments = json.loads(line)
        print(json.dumps(member.do(verb, **arguments)), flush=True)
    member.replica.close()


if __name__ == "__main__":
    main()
