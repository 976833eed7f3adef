"""One replica as a process of its own, told what to do line by line on stdin.

Run as: python member.py '{"endpoint": …, "mode": …, "connect": […], "skew": …, "file": …,
"more": …, "record": …, "slow": …}'
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import threading
import time
import timeit
from pathlib import Path
from typing import Any

from rosz.errors import PartlyWritten
from rosz.params import DELETED, condense, normalise, split, spread
from rosz.params.replica import Changed, Params, Replica
from rosz.params.replica.core import events
from rosz.params.replica.storage import Storage, StoreFile
from rosz.session import (
    HybridClock,
    MeshReadiness,
    Sample,
    Session,
    SessionConfig,
    Stamp,
    serve_links,
)

_PATIENT = 50.0
"""Seconds after which others count as silent; the default is for a machine that is not busy."""


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
        self,
        *,
        endpoint: str,
        mode: Any,
        connect: list[str],
        skew: float,
        file: str,
        more: int,
        record: str = "",
        slow: float = 0.0,
    ) -> None:
        if record:
            sys.path.append(str(Path(__file__).parents[1]))
            importlib.import_module("params.recording").record_to(Path(record))
        begun = time.perf_counter()
        self._session = Session.open(
            SessionConfig(rendezvous=endpoint, mode=mode, connect=tuple(connect))
        )
        if skew:
            self._session.clock = SkewedClock(self._session.zid, int(skew * 1e9))
        settled = None
        if mode == "peer":
            serve_links(self._session)
            settled = MeshReadiness(self._session, 0.5, threading.Event()).ready
        self._file = StoreFile(Path(file)) if file else None
        storage = None if self._file is None else Storage(self._file)
        self.replica = Replica(
            self._session, label=f"member {os.getpid()}", settled=settled, storage=storage
        )
        self.joined = time.perf_counter() - begun
        if slow:
            self._apply_slowly(slow)
        self._crowd = [
            Replica(Session.open(SessionConfig(rendezvous=endpoint, mode=mode)))
            for _ in range(more)
        ]
        self._delays: list[float] = []
        self._bare: list[Any] = []

    def _apply_slowly(self, seconds: float) -> None:
        """Take so long for each batch, as for a very large one."""
        runner = self.replica._runner
        step = runner._step

        def step_slowly(event: events.Event) -> Any:
            if isinstance(event, events.WriteCalled | events.BatchReceived):
                time.sleep(seconds)
            return step(event)

        runner._step = step_slowly  # type: ignore[method-assign]

    def do(self, verb: str, **arguments: Any) -> Any:
        return getattr(self, f"do_{verb}")(**arguments)

    def do_set(self, name: str, value: Any, timeout: float = _PATIENT) -> Any:
        begun = time.perf_counter()
        try:
            outcome = self.replica.set(name, value, timeout=timeout)
        except PartlyWritten as error:
            return {"partly": str(error)}
        return {"slow": outcome.slow, "seconds": time.perf_counter() - begun}

    def do_fill(self) -> None:
        """Let the file not grow any more, as on a full disk."""
        assert self._file is not None
        self._file._base.execute("PRAGMA max_page_count = 1")

    def do_delete(self, name: str, timeout: float = _PATIENT) -> Any:
        return self.replica.delete(name, timeout=timeout).slow

    def do_clear(self, namespace: str) -> Any:
        """Delete every parameter in a namespace, each by itself."""
        names = [name for name in self.replica.names() if name.startswith(f"{namespace}/")]
        self.replica.write([(split(name), DELETED) for name in names], timeout=0.3)
        return len(names)

    def do_forget(self, keep: int) -> Any:
        """Forget old deletions, as a replica does from time to time."""
        with self.replica._runner as history:
            return history.forget(keep)

    def do_get(self, name: str) -> Any:
        return self.replica.get(name)

    def do_storm(self, prefix: str, count: int, log: str, timeout: float = _PATIENT) -> Any:
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
        outcome = self.replica.write(
            condense(spread(namespace, normalise(values))), timeout=_PATIENT
        )
        return {"slow": outcome.slow, "seconds": time.perf_counter() - begun}

    def do_state(self) -> Any:
        return {
            "digest": self.replica.digest().hex(),
            "count": len(self.replica.names()),
            "members": len(self.replica.members()),
        }

    def do_root(self) -> Any:
        return self.replica.root

    def do_everywhere(self, name: str) -> Any:
        """Return the values on all replicas of this process."""
        return [replica.get(name) for replica in (self.replica, *self._crowd)]

    def do_digests(self) -> Any:
        """Return the different digests of all replicas of this process."""
        return sorted({replica.digest().hex() for replica in (self.replica, *self._crowd)})

    def do_joined(self) -> Any:
        """Tell how many seconds it took from nothing to a replica that has everything."""
        return self.joined

    def do_writes(self, name: str, count: int) -> Any:
        """Return the seconds that each of so many sets took; the values are when they began."""
        taken = []
        for _ in range(count):
            begun = time.monotonic_ns()
            self.replica.set(name, begun)
            taken.append((time.monotonic_ns() - begun) / 1e9)
        return taken

    def do_reads(self, count: int) -> Any:
        """Return the seconds that one read takes."""
        params = Params(self.replica, "/bench/node")
        params["~gain"] = 1.5
        return min(timeit.repeat(lambda: params["~gain"], number=count, repeat=3)) / count

    def do_watch(self, name: str) -> Any:
        """Note how old each value is when the callback gets it."""
        self.replica.watch(name, self._note_delay)

    def _note_delay(self, change: Changed) -> None:
        if isinstance(change.new, int):
            self._delays.append((time.monotonic_ns() - change.new) / 1e9)

    def do_echo(self, key: str) -> Any:
        """ClientReply puts as a replica does, and do nothing else."""
        back = self._session.publisher(f"{key}/back")
        self._bare += [back, self._session.subscriber(key, lambda _sample: back.put(b"0"))]

    def do_bare(self, key: str, count: int, echoes: int) -> Any:
        """Return the seconds that each of so many puts took to be answered by all."""
        heard: list[int] = []
        done = threading.Semaphore(0)

        def hear(_sample: Sample) -> None:
            heard.append(1)
            if len(heard) % echoes == 0:
                done.release()

        ear = self._session.subscriber(f"{key}/back", hear)
        there = self._session.publisher(key, block=True)
        while not there.matched:
            time.sleep(0.01)
        taken = []
        for _ in range(count):
            begun = time.perf_counter()
            there.put(b"some ninety bytes, as a write of a parameter has" * 2)
            done.acquire()
            taken.append(time.perf_counter() - begun)
        ear.close()
        there.close()
        return taken

    def do_delays(self) -> Any:
        """Return what was noted since the last time."""
        found, self._delays = self._delays, []
        return found


def main() -> None:
    member = Member(**json.loads(sys.argv[1]))
    print(json.dumps("up"), flush=True)
    for line in sys.stdin:
        verb, arguments = json.loads(line)
        print(json.dumps(member.do(verb, **arguments)), flush=True)
    member.replica.close()


if __name__ == "__main__":
    main()
