"""Replicas as processes, and a cable between them that can be cut."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from network import TIMEOUT, Program, eventually, free_port

ROOT = Path(__file__).parents[2]


class Process(Program):
    """A member, which replies to requests in lines of JSON.

    `tell` and `answer` are apart so that many work at a time. Another root folder has another
    version of rosz, and of the member.
    """

    def __init__(
        self,
        endpoint: str,
        *,
        mode: str = "peer",
        connect: Iterable[str] = (),
        skew: float = 0.0,
        file: str = "",
        more: int = 0,
        record: str = "",
        slow: float = 0.0,
        root: Path = ROOT,
    ) -> None:
        settings = {
            "endpoint": endpoint,
            "mode": mode,
            "connect": list(connect),
            "skew": skew,
            "file": file,
            "more": more,
        }
        if record:
            settings["record"] = record
        if slow:
            settings["slow"] = slow
        script = str(root / "tests" / "params" / "member.py")
        super().__init__(
            [sys.executable, "-P", script, json.dumps(settings)],
            {**os.environ, "PYTHONPATH": str(root)},
            separate=True,
        )
        self._answered = 0

    def tell(self, verb: str, **arguments: Any) -> None:
        self.say(json.dumps([verb, arguments]))

    def answer(self, timeout: float = 4 * TIMEOUT) -> Any:
        answered = self.wait_until(lambda: len(self.lines) > self._answered, timeout)
        assert answered, f"no answer within {timeout} s, or the member ended:\n{self.errors}"
        self._answered += 1
        return json.loads(self.lines[self._answered - 1])

    def do(self, verb: str, **arguments: Any) -> Any:
        self.tell(verb, **arguments)
        return self.answer()

    def stop(self) -> None:
        """Keep it from running, and wait until it does not."""
        self.send(signal.SIGSTOP)
        status = Path(f"/proc/{self.pid}/stat")
        eventually(lambda: status.read_text().rpartition(")")[2].split()[0] == "T", "its stop")

    def end(self) -> None:
        """Let it end in the ordinary way: by the end of its stdin."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(TIMEOUT)

    def resume(self) -> None:
        """Let it run again."""
        self.send(signal.SIGCONT)


class Fleet:
    """All members of one test."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        # Not a socket file: of several that start at once, each may take it for left over.
        self.rendezvous = f"tcp/127.0.0.1:{free_port()}"
        self._all: list[Process] = []

    def start(self, *, endpoint: str = "", wait: bool = True, **settings: Any) -> Process:
        process = Process(endpoint or self.rendezvous, **settings)
        self._all.append(process)
        if wait:
            assert process.answer() == "up"
        return process

    def start_many(self, count: int, **settings: Any) -> list[Process]:
        found = [self.start(wait=False, **settings) for _ in range(count)]
        for process in found:
            assert process.answer() == "up"
        until_known(found)
        return found

    def close(self) -> None:
        for process in self._all:
            process.close()


def states(processes: Iterable[Process]) -> list[dict[str, Any]]:
    every = list(processes)
    for process in every:
        process.tell("state")
    return [process.answer() for process in every]


def until_known(processes: list[Process], others: int = 0) -> None:
    """Wait until all know all, or so many others."""
    others = others or len(processes) - 1

    def known() -> bool:
        return all(state["members"] >= others for state in states(processes))

    eventually(known, "all know each other", TIMEOUT)


def until_same(processes: list[Process], what: str) -> float:
    """Wait until all hold the same; print and return how long that took."""
    begun = time.monotonic()

    def same() -> bool:
        return len({state["digest"] for state in states(processes)}) == 1

    eventually(same, "all hold the same", TIMEOUT)
    took = time.monotonic() - begun
    print(f"{what}: the same on {len(processes)} replicas after {took:.3f} s")
    roots = [process.do("root") for process in processes]
    assert all(root == roots[0] for root in roots)
    return took


class Cable:
    """A TCP connection through here, to be cut or held up."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._ends: list[socket.socket] = []
        self._lock = threading.Lock()
        self._whole = threading.Event()
        self._flowing = threading.Event()
        self._until_hold = 0
        self._whole.set()
        self._flowing.set()
        self.port = int(self._listener.getsockname()[1])
        self._closed = False
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Break the connection, and refuse new ones."""
        self._whole.clear()
        self._drop()

    def mend(self) -> None:
        """Let connections through again."""
        self._whole.set()

    def hold(self, after: int = 0) -> None:
        """Keep the connection, and let nothing through, once so many bytes have passed."""
        self._until_hold = after
        if not after:
            self._flowing.clear()

    def release(self) -> None:
        """Let through what was held."""
        self._flowing.set()

    def close(self) -> None:
        self._closed = True
        self._flowing.set()
        self._listener.close()
        self._drop()

    def _drop(self) -> None:
        with self._lock:
            for end in self._ends:
                try:
                    end.shutdown(socket.SHUT_RDWR)
                except OSError:
                    continue
            self._ends.clear()

    def _accept(self) -> None:
        while not self._closed:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            if not self._whole.is_set():
                near.close()
                continue
            try:
                far = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                near.close()
                continue
            with self._lock:
                self._ends += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                self._flowing.wait()
                sink.sendall(data)
                if self._until_hold:
                    self._until_hold -= len(data)
                    if self._until_hold <= 0:
                        self.hold()
        except OSError:
            pass
        finally:
            source.close()
            sink.close()
