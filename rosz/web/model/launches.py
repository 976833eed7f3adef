"""Running launches and the output of their nodes, followed while a page shows them."""

from __future__ import annotations

import logging
import threading
from typing import Literal

import msgspec

from rosz.access import PagePolicy
from rosz.errors import NotFoundError, RoszError
from rosz.launch.run import LaunchStatus, NodeStatus, StatusClient
from rosz.node import Node
from rosz.queue import BoundedQueue
from rosz.worker import Worker, run_task

_PERIOD = 2.0
_OUTPUT_PERIOD = 0.4
_MOST_BYTES = 262_144
_log = logging.getLogger("rosz.web")


class RunningLaunch(msgspec.Struct, frozen=True):
    """A launch that runs.

    Attributes:
        key: Its name in requests.
        status: Its status.
        shares: Share of one processor that each node uses, by name; those that are known.
    """

    key: str
    status: LaunchStatus
    shares: dict[str, float]

    def find(self, name: str) -> NodeStatus | None:
        """Return the node of a name, or None."""
        return next((node for node in self.status.nodes if node.name == name), None)


class Launches:
    """The running launches, until it is closed.

    Args:
        node: The node whose session asks them.
        permission: The changes that the page may make.

    Attributes:
        found: The launches, or None before they were first looked for.
        fault: Why they could not be found; empty if they could.
    """

    def __init__(self, node: Node, permission: PagePolicy) -> None:
        self.found: tuple[RunningLaunch, ...] | None = None
        self.fault: str = ""
        self._permission = permission
        self._client = StatusClient(node.context.session, node.context.domain)
        self._worker = Worker("rosz-web-launches", run_task, logger=_log)
        self._worker.submit(self._look_again)

    def _look_again(self) -> None:
        self._look()
        self._worker.later(_PERIOD, self._look_again)

    def _look(self) -> None:
        before = {launch.key: launch for launch in self.found or ()}
        try:
            running = self._client.running()
        except RoszError as error:
            self.fault = str(error)
            self.found = self.found or ()
            return
        self.found = tuple(
            RunningLaunch(key, status, _shares(status, before.get(key)))
            for key, status in running.items()
        )
        self.fault = ""

    def act(self, key: str, action: Literal["restart", "stop"], name: str) -> None:
        """Restart or stop a node of a launch, and wait until that is done.

        Args:
            key: Key of the launch.
            action: The action.
            name: Full name of the node.

        Raises:
            UsageError: The page may not.
            LaunchError: The launch refuses, or the node could not be started again.
        """
        self._permission.check_control(f"control '{name}'")
        try:
            self._client.act(key, action, name)
        finally:
            self._worker.submit(self._look)

    def describe(self, launch: RunningLaunch, name: str, action: Literal["restart", "stop"]) -> str:
        """Return what restarting or stopping a node means, in words; empty if that is plain."""
        node = launch.find(name)
        if node is None:
            return ""
        parts = []
        if node.members:
            ends = "end with it" if action == "stop" else "start again with it"
            parts.append(f"It is a container: {', '.join(node.members)} {ends}.")
        if action == "restart":
            return " ".join(parts)
        if not any(other.pid for other in launch.status.nodes if other.name != name):
            parts.append("No other node of its launch runs: the launch ends with it.")
            return " ".join(parts)
        parts.append("It is not started again until you restart it.")
        if node.required:
            parts.append("It is required, but a stop on request does not end the launch.")
        return " ".join(parts)

    def close(self) -> None:
        """Look for them no longer."""
        self._worker.close(timeout=0)


def _shares(status: LaunchStatus, before: RunningLaunch | None) -> dict[str, float]:
    if before is None:
        return {}
    seconds = status.sampled - before.status.sampled
    earlier = {node.name: node for node in before.status.nodes}
    return {
        node.name: max(0.0, node.cpu - earlier[node.name].cpu) / seconds
        for node in status.nodes
        if node.name in earlier and node.pid == earlier[node.name].pid and node.pid and seconds > 0
    }


class NodeOutput:
    """The output of one node of a launch, followed until it is closed; bounded in bytes.

    Args:
        node: The node whose session asks the launch.
        name: Full name of the node whose output it is.

    Attributes:
        state: The state of the node as the launch reports it, or the reason of a failure.
        skipped: Number of bytes that were left out, as they came faster than they are read.
    """

    def __init__(self, node: Node, name: str) -> None:
        self.state: str = ""
        self.skipped: int = 0
        self._name = name
        self._client = StatusClient(node.context.session, node.context.domain)
        self._lock = threading.Lock()
        self._parts: BoundedQueue[str] = BoundedQueue(most_bytes=_MOST_BYTES)
        self._launch: RunningLaunch | None = None
        self._position: tuple[int, int] | None = None
        self._worker = Worker("rosz-web-output", run_task, logger=_log)
        self._worker.submit(self._turn)

    def _turn(self) -> None:
        try:
            self._read()
        except RoszError as error:
            self._launch = None
            self.state = str(error)
        self._worker.later(_OUTPUT_PERIOD if self._launch else _PERIOD, self._turn)

    def _read(self) -> None:
        if self._launch is None:
            self._launch = self._find()
            self._position = None
            self.state = ""
        excerpt = self._client.read_output(self._launch.key, self._name, self._position)
        if self._position is not None:
            self.skipped += excerpt.skipped
        self._position = excerpt.position
        if excerpt.text:
            with self._lock:
                self._parts.put(excerpt.text, len(excerpt.text))

    def _find(self) -> RunningLaunch:
        running = self._client.running()
        for key, status in running.items():
            launch = RunningLaunch(key, status, {})
            if launch.find(self._name) is not None:
                return launch
            for node in status.nodes:
                if self._name in node.members:
                    raise NotFoundError(
                        f"'{self._name}' is in container '{node.name}': its output is that of the"
                        " container"
                    )
        raise NotFoundError(f"no launch runs '{self._name}'")

    def take(self) -> str:
        """Return and forget the output since the last call."""
        with self._lock:
            text = "".join(self._parts)
            self._parts.clear()
        return text

    def close(self) -> None:
        """Follow it no longer."""
        self._worker.close(timeout=0)
