"""A master for ROS 1's programs, with which they take part in the network of rosz."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import msgspec

from rosz.bridges.ros1.master import Master
from rosz.bridges.ros1.mirror import Mirror
from rosz.bridges.ros1.node_api import NodeApi
from rosz.bridges.ros1.peers import call
from rosz.bridges.ros1.registrations import Registrations
from rosz.bridges.ros1.registry import Change, RegistryEntry
from rosz.bridges.ros1.server import Ros1Server
from rosz.bridges.ros1.shared import MASTER, MASTER_NODE, BridgeResources
from rosz.bridges.ros1.sockets import log
from rosz.environment import Environment
from rosz.errors import RoszError, TransportError
from rosz.lifecycle import Closing, Registration
from rosz.node import BridgedNode, Context

MASTER_PORT = 11311
"""Default port of ROS 1's master."""

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
    """Return a master for programs of this machine, at the default port if it is free.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """
    try:
        return MasterBridge(environment)
    except TransportError:
        return MasterBridge(environment, port=0)


class MasterBridge(Closing):
    """A master of ROS 1; its nodes take part in the network of rosz.

    Args:
        environment: Settings; those of the process when not given.
        host: Address to listen at.
        port: Port to listen at; 0 for any.

    Attributes:
        port: Port at which the master listens.

    Raises:
        TransportError: It cannot listen at the port, or the session cannot be opened.
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
        self._shared = shared = BridgeResources(context, is_master=True)
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
        server = Ros1Server(shared.loop, host, port)
        self._lifecycle.keep(server)
        self.port: int = server.port
        machine = re.sub(r"\W", "_", socket.gethostname(), flags=re.ASCII)
        shared.name = f"{MASTER_NODE}{machine}_{self.port}"
        api = NodeApi(shared, self.port)
        self._registrations = Registrations(shared, self.port, self._on_changes)
        master = Master(shared, self._registrations, api.answer)
        self._bridge_node = BridgedNode(shared.context, shared.name, lambda _reason: None)
        self._lifecycle.keep(self._bridge_node)
        self._mirror = api.mirror = Mirror(
            shared, self._bridge_node, self._registrations.terminate, self._registrations.notify
        )
        self._lifecycle.keep(self._mirror)
        self._state_file = environment.home / "rosz" / f"ros1_master_{self.port}.json"
        self._saving = False
        server.start(master.dispatch, self._mirror.accept)
        self._restore()
        shared.prober.start(self._registrations.registry.nodes, self._on_probe)

    def nodes(self) -> dict[str, str]:
        """Return the URIs of the nodes that are registered, by name."""
        return self._registrations.registry.nodes()

    def close(self) -> None:
        """Close the master; a second call has no effect."""
        self._lifecycle.close()

    def _on_changes(self, changes: list[Change]) -> None:
        self._mirror.apply(changes)
        if not self._saving:
            self._saving = True
            self._shared.changes.submit(self._save)

    def _on_probe(self, node: str, uri: str, is_there: bool) -> None:
        if not is_there and self._registrations.drop(node, uri):
            log.info("node '%s' of ROS 1 has ended", node)

    # Registrations are stored, so that a master that is restarted knows the nodes.

    def _save(self) -> None:
        self._saving = False
        entries = self._registrations.registry.dump()
        new = self._state_file.with_suffix(".new")
        try:
            self._state_file.parent.mkdir(parents=True, exist_ok=True)
            new.write_bytes(msgspec.json.encode(entries))
            new.replace(self._state_file)
        except OSError as error:
            log.warning("cannot save ROS 1's registrations in %s: %s", self._state_file, error)

    def _restore(self) -> None:
        """Register the nodes that the last master at this port stored and that still answer."""
        entries = _read(self._state_file)
        waiting = {(entry.node, entry.uri) for entry in entries}
        alive: set[tuple[str, str]] = set()
        lock = threading.Lock()

        def check(node: str, uri: str) -> None:
            is_alive = _answers(node, uri)
            with lock:
                waiting.discard((node, uri))
                if is_alive:
                    alive.add((node, uri))
                is_last = not waiting
            if is_last:
                self._registrations.restore([e for e in entries if (e.node, e.uri) in alive])

        for node, uri in list(waiting):
            self._shared.requests.submit(partial(check, node, uri))


def _answers(node: str, uri: str) -> bool:
    try:
        call(uri, "getPid", (MASTER,), _PROBE_TIMEOUT)
    except RoszError as error:
        log.info("node '%s' of ROS 1 has ended: %s", node, error)
        return False
    return True


def _read(file: Path) -> list[RegistryEntry]:
    try:
        return msgspec.json.decode(file.read_bytes(), type=list[RegistryEntry])
    except FileNotFoundError:
        return []
    except (OSError, msgspec.MsgspecError) as error:
        log.warning("cannot read ROS 1's registrations in %s: %s", file, error)
        return []
