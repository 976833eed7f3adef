"""Detection of ROS 1 nodes that have ended: a killed node does not unregister."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rosz.bridges.ros1.peers import is_listening
from rosz.worker import Worker

__all__ = ("Prober",)

_PERIOD = 3.0
_TIMEOUT = 2.0

_Tasks = Worker[Callable[[], object]]


class Prober:
    """Checks every three seconds, and on request, whether nodes listen at their URIs.

    Args:
        requests: Threads for what waits for other programs.
        timer: Worker for what is to be done later.
    """

    def __init__(self, requests: _Tasks, timer: _Tasks) -> None:
        self._requests = requests
        self._timer = timer
        self._nodes: Callable[[], dict[str, str]] = dict
        self._found: Callable[[str, str, bool], object] = _ignore
        self._checking: set[tuple[str, str]] = set()

    def start(
        self, nodes: Callable[[], dict[str, str]], found: Callable[[str, str, bool], object]
    ) -> None:
        """Look at the nodes from now on.

        Args:
            nodes: Function that returns the URIs of the nodes by name.
            found: Function called with a node, its URI and whether it listens there, on a thread
                for requests.
        """
        self._nodes, self._found = nodes, found
        self._timer.later(_PERIOD, self._look)

    def check(self, node: str, uri: str) -> None:
        """Look at a node soon, as it may have ended; any thread may call it.

        Args:
            node: Name of the node.
            uri: Its URI.
        """
        if (node, uri) not in self._checking:
            self._checking.add((node, uri))
            self._requests.submit(partial(self._check, node, uri))

    def _look(self) -> None:
        for node, uri in self._nodes().items():
            self.check(node, uri)
        self._timer.later(_PERIOD, self._look)

    def _check(self, node: str, uri: str) -> None:
        try:
            self._found(node, uri, is_listening(uri, _TIMEOUT))
        finally:
            self._checking.discard((node, uri))


def _ignore(_node: str, _uri: str, _is_there: bool) -> None:
    """Do nothing with what is found before the start."""
