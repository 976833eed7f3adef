"""Detecting when a node needs the services that every node of ROS 2 has.

A node declares them (`rosz.node.ros2_parameters`) when a process appears that may want them: one
that is not rosz, or a client of one of these services. Until then they cost nothing, and no list of
services shows them.
"""

from __future__ import annotations

import threading
from collections import Counter

from rosz.errors import ClosedError
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.wire import Kind, Token
from rosz.worker import start_thread

__all__ = ("Ros2PeerDetector",)

_PACKAGES = ("rcl_interfaces/srv/", "type_description_interfaces/srv/")
_KNOWN_BY = 0.15
"""Seconds within which a rosz process shows that it is one; ROS 2 waits longer for services."""
_GONE_BY = 0.05
"""Seconds within which all tokens of a process that ends are gone."""


class Ros2PeerDetector:
    """Follow the graph until there is a reason to declare the services of a node.

    Args:
        node: The node.
    """

    def __init__(self, node: NodeCore) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._own = node.context.session.zid
        self._tokens: Counter[str] = Counter()
        self._suspects: set[str] = set()
        self._stop = threading.Event()
        self._wanted = False
        self._registration = Registration(node.context.graph.listen(self._changed))

    def close(self) -> None:
        """Stop following the graph; a second call has no effect."""
        self._stop.set()
        self._registration.close()

    def _changed(self, token: Token, alive: bool) -> None:
        """Note a token; on the thread of the graph, once for every token there is."""
        self._tokens[token.zid] += 1 if alive else -1
        count = self._tokens[token.zid]
        if not count:
            del self._tokens[token.zid]
        if not alive:
            return
        if (
            token.kind is Kind.CLIENT
            and token.type_name.startswith(_PACKAGES)
            and token.name.rpartition("/")[0] == self._node.name
        ):
            self._wanted = True
            self._start()
        elif count == 1 and token.zid != self._own:
            with self._lock:
                idle = not self._suspects
                self._suspects.add(token.zid)
            if idle:
                self._start()

    def _start(self) -> None:
        name = f"rosz-ros2{self._node.name}"
        start_thread(threading.Thread(target=self._run, name=name, daemon=True))

    def _run(self) -> None:
        # A rosz process shows that it is one by another token, which may come a moment later.
        while not self._wanted and not self._stop.wait(_KNOWN_BY):
            with self._lock:
                suspects, self._suspects = self._suspects, set()
            if not suspects:
                return
            # The last tokens of a process that ends may go in any order, too.
            if (
                self._is_foreign(suspects)
                and not self._stop.wait(_GONE_BY)
                and self._is_foreign(suspects)
            ):
                break
        if not self._stop.is_set():
            self._declare()

    def _is_foreign(self, suspects: set[str]) -> bool:
        """Return whether one of some sessions is alive and does not belong to rosz."""
        view = self._node.context.graph.view()
        return any(t.zid in suspects and not view.is_rosz(t.zid) for t in view.tokens)

    def _declare(self) -> None:
        from rosz.node.ros2_parameters import Ros2ParameterServices

        with self._lock:
            if self._stop.is_set():
                return
            self.close()
            try:
                self._node.keep(Ros2ParameterServices(self._node))
            except ClosedError:
                return  # the node ends
