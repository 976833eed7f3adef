"""rosz as the master of ROS 1's programs."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Self

import msgspec

from rosz.bridges.ros1.master import Master
from rosz.bridges.ros1.mirror import Mirror
from rosz.bridges.ros1.node_api import NodeApi
from rosz.bridges.ros1.peers import call
from rosz.bridges.ros1.registry import Change, Entry
from rosz.bridges.ros1.server import Server
from rosz.bridges.ros1.shared import MASTER, MASTER_NODE, Shared
from rosz.bridges.ros1.sockets import log
from rosz.environment import Environment
from rosz.errors import RoszError, TransportError
from rosz.lifecycle import Registration
from rosz.node import BridgedNode, Context

__all__ = ("MASTER_PORT", "MasterBridge", "open_master", "running_master")

MASTER_PORT = 11311
"""Port of ROS 1's master, unless ``ROS_MASTER_URI`` names another one."""

_PROBE_TIMEOUT = 2.0


def running_master(environ: Mapping[str, str]) -> str:
    """Return the URI in ``ROS_MASTER_URI`` if a master answers there; empty otherwise."""
    uri = environ.get("ROS_MASTER_URI", "")
    try:
        if uri:
            call(uri, "getUri", (MASTER,), _PROBE_TIMEOUT)
    except RoszError:
        return ""
    return uri


def open_master(environment: Environment) -> MasterBridge:
    """Return a master for programs of this machine, at the usual port if that is free.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """
    try:
        return MasterBridge(environment)
    except TransportError:
        return MasterBridge(environment, port=0)


class MasterBridge:
    """A master of ROS 1, whose nodes take part in the network of rosz.

    Args:
        environment: Settings; those of the process when not given.
        host: Address to listen at.
        port: Port to listen at; 0 for any.

    Attributes:
        port: Port that it listens at.

    Raises:
        TransportError: It cannot listen there, or the session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """

    def __init__(
        self,
        environment: Environment | None = None,
        host: str = "127.0.0.1",
        port: int = MASTER_PORT,
    ) -> None:
        environment = environment or Environment.read()
        context = Context(environment)
        self._shared = shared = Shared(context, "", is_master=True)
        self._lifecycle = shared.lifecycle
        self._lifecycle.keep(context)
        self._lifecycle.keep(Registration(shared.close))
        try:
            self._open(environment, host, port)
        except BaseException:
            self.close()
            raise

    def _open(self, environment: Environment, host: str, port: int) -> None:
        shared = self._shared
        server = Server(shared.loop, host, port)
        self._lifecycle.keep(server)
        self.port: int = server.port
        machine = re.sub(r"\W", "_", socket.gethostname(), flags=re.ASCII)
        shared.name = f"{MASTER_NODE}{machine}_{self.port}"
        api = NodeApi(shared, self.port)
        self._master = Master(shared, self.port, self._on_changes, api.answer)
        self._own = BridgedNode(shared.context, shared.name, lambda _reason: None)
        self._lifecycle.keep(self._own)
        self._mirror = api.mirror = Mirror(
            shared, self._own, self._master.terminate, self._master.notify
        )
        self._lifecycle.keep(self._mirror)
        self._file = environment.home / "rosz" / f"ros1_master_{self.port}.json"
        self._saving = False
        server.start(self._master.dispatch, self._mirror.accept)
        self._restore()
        shared.prober.start(self._master.nodes, self._on_probe)

    def nodes(self) -> dict[str, str]:
        """Return the URIs of the nodes that are registered, by name."""
        return self._master.nodes()

    def close(self) -> None:
        """End the master; a second call has no effect."""
        self._lifecycle.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _on_changes(self, changes: list[Change]) -> None:
        self._mirror.apply(changes)
        if not self._saving:
            self._saving = True
            self._shared.changes.submit(self._save)

    def _on_probe(self, node: str, uri: str, is_there: bool) -> None:
        if not is_there and self._master.drop(node, uri):
            log.info("node '%s' of ROS 1 has ended", node)

    # Registrations outlive the master.

    def _save(self) -> None:
        self._saving = False
        entries = self._master.entries()
        new = self._file.with_suffix(".new")
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            new.write_bytes(msgspec.json.encode(entries))
            new.replace(self._file)
        except OSError as error:
            log.warning(
                "cannot keep ROS 1's registrations for a restart in %s: %s", self._file, error
            )

    def _restore(self) -> None:
        """Register the nodes of the last master of this port that are still alive."""
        entries = _read(self._file)
        waiting = {(entry.node, entry.uri) for entry in entries}
        alive: set[tuple[str, str]] = set()
        lock = threading.Lock()

        def check(node: str, uri: str) -> None:
            found = _answers(node, uri)
            with lock:
                waiting.discard((node, uri))
                if found:
                    alive.add((node, uri))
                last = not waiting
            if last:
                self._master.restore([e for e in entries if (e.node, e.uri) in alive])

        for node, uri in list(waiting):
            self._shared.requests.submit(partial(check, node, uri))


def _answers(node: str, uri: str) -> bool:
    try:
        call(uri, "getPid", (MASTER,), _PROBE_TIMEOUT)
    except RoszError as error:
        log.info("node '%s' of ROS 1 has ended: %s", node, error)
        return False
    return True


def _read(file: Path) -> list[Entry]:
    try:
        return msgspec.json.decode(file.read_bytes(), type=list[Entry])
    except FileNotFoundError:
        return []
    except (OSError, msgspec.MsgspecError) as error:
        log.warning("cannot read ROS 1's registrations in %s: %s", file, error)
        return []
