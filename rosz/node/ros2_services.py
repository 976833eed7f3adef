"""When a node declares the services that every node of ROS 2 has (`rosz.node.ros2_bundle`).

That is when somebody is there who may want them: a node that is not of rosz, or a client of one of
them. Until then they cost nothing, and stand in nobody's list of services.
"""

from __future__ import annotations

import threading
from collections import Counter
from typing import TYPE_CHECKING

from rosz.errors import ClosedError
from rosz.node.endpoint import Withdrawal
from rosz.session.starting import start
from rosz.wire import Kind, Token

if TYPE_CHECKING:
    from rosz.node.node import Node

__all__ = ("Lookout",)

_PACKAGES = ("rcl_interfaces/srv/", "type_description_interfaces/srv/")
_KNOWN_BY = 0.15
"""Seconds by which a node of rosz is known to be one; who looks for services waits longer."""
_GONE_BY = 0.05
"""Seconds by which all tokens of one that ends are gone."""


class Lookout:
    """Follows the graph until there is reason to declare the services of a node.

    Args:
        node: Whose services.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._own = node.context.session.zid
        self._tokens: Counter[str] = Counter()
        self._suspects: set[str] = set()
        self._stop = threading.Event()
        self._wanted = False
        self._withdrawal = Withdrawal(node.context.graph.listen(self._changed))

    def close(self) -> None:
        """Look no more; again is no error."""
        self._stop.set()
        self._withdrawal.close()

    def _changed(self, token: Token, alive: bool) -> None:
        """Take note of a token; on the thread of the graph, once for every token there is."""
        self._tokens[token.zid] += 1 if alive else -1
        count = self._tokens[token.zid]
        if not count:
            del self._tokens[token.zid]
        if not alive:
            return
        if token.kind is Kind.CLIENT and self._is_wanted(token):
            self._wanted = True
            self._start()
        elif count == 1 and token.zid != self._own:
            with self._lock:
                idle = not self._suspects
                self._suspects.add(token.zid)
            if idle:
                self._start()

    def _is_wanted(self, token: Token) -> bool:
        below = token.name.rpartition("/")[0]
        return below == self._node.name and token.type_name.startswith(_PACKAGES)

    def _start(self) -> None:
        name = f"rosz-ros2{self._node.name}"
        start(threading.Thread(target=self._run, name=name, daemon=True))

    def _run(self) -> None:
        # A node of rosz says that it is one by another token, which may be a moment behind.
        while not self._wanted and not self._stop.wait(_KNOWN_BY):
            with self._lock:
                suspects, self._suspects = self._suspects, set()
            if not suspects:
                return
            # The last tokens of one that ends may go in any order, too.
            if (
                self._is_foreign(suspects)
                and not self._stop.wait(_GONE_BY)
                and self._is_foreign(suspects)
            ):
                break
        if not self._stop.is_set():
            self._declare()

    def _is_foreign(self, suspects: set[str]) -> bool:
        """Tell whether one of some sessions that are alive is not of rosz."""
        view = self._node.context.graph.view()
        return any(t.zid in suspects and not view.is_rosz(t.zid) for t in view.tokens)

    def _declare(self) -> None:
        from rosz.node.ros2_bundle import Bundle

        with self._lock:
            if self._stop.is_set():
                return
            self.close()
            try:
                self._node.keep(Bundle(self._node))
            except ClosedError:
                return  # the node ends
