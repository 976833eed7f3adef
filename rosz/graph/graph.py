"""The live view of a domain.

Zenoh's thread only queues what it sees. One thread of the graph applies it, wakes waiters and runs
listeners, so a listener may take its time and may call anything.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, DecodeError, WaitTimeout, near_miss
from rosz.graph.view import View
from rosz.wire import (
    OWN_SPACE,
    ProcessToken,
    Token,
    parse_process,
    parse_token,
    processes_key,
    tokens_key,
)

if TYPE_CHECKING:
    from rosz.session import Session

__all__ = ("Graph", "GraphListener", "ProcessListener")

GraphListener = Callable[[Token, bool], None]
"""Gets a token, and whether it appeared (true) or went (false)."""

ProcessListener = Callable[[ProcessToken, bool], None]
"""Gets a rosz node as a process, and whether it appeared (true) or went (false)."""

_log = logging.getLogger("rosz.graph")


class Graph:
    """Nodes and endpoints of a domain, followed as they come and go.

    Args:
        session: Where to look.
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self.domain = domain
        self._session = session
        self._tokens: dict[str, Token] = {}
        self._processes: dict[str, ProcessToken] = {}
        self._changed = threading.Condition()
        self._listeners: dict[int, GraphListener] = {}
        self._process_listeners: dict[int, ProcessListener] = {}
        self._events: SimpleQueue[tuple[str, bool] | Callable[[], None] | None] = SimpleQueue()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="rosz-graph", daemon=True)
        self._thread.start()
        self._watches = [
            session.tokens(key, lambda key, alive: self._events.put((key, alive)))
            for key in (tokens_key(domain), processes_key(domain))
        ]

    def view(self) -> View:
        """Return what is known at this moment."""
        with self._changed:
            return View(self._tokens.values())

    def processes(self) -> list[ProcessToken]:
        """Return the rosz nodes with their processes, sorted by name; ROS 2 tells none."""
        with self._changed:
            return sorted(self._processes.values(), key=lambda process: process.node)

    def refresh(self, timeout: float = 2.0) -> View:
        """Ask the network for all tokens, and return them with what is known already.

        Args:
            timeout: Seconds.

        Raises:
            ClosedError: The session is closed.
            WaitTimeout: No end of answers.
        """
        for space in (tokens_key(self.domain), processes_key(self.domain)):
            for key in self._session.live_tokens(space, timeout):
                self._events.put((key, True))
        self._drain(timeout)
        return self.view()

    def _drain(self, timeout: float) -> None:
        """Wait until everything queued so far has been applied."""
        if threading.current_thread() is self._thread:
            return
        done = threading.Event()
        self._events.put(done.set)
        if not done.wait(timeout):
            raise WaitTimeout("turn of the graph thread", timeout, "a listener blocks it")

    def listen(self, listener: GraphListener, *, history: bool = True) -> Callable[[], None]:
        """Have every change told, in order, on the graph's thread.

        Args:
            listener: Gets each token that appears or goes; what it raises is logged.
            history: Whether to tell what is alive already, first.

        Returns:
            A function that ends it.
        """
        key = id(listener)

        def begin() -> None:
            if history:
                for token in list(self._tokens.values()):
                    _tell(listener, token, token.node_name, alive=True)
            self._listeners[key] = listener

        if threading.current_thread() is self._thread:
            begin()
        else:
            self._events.put(begin)
        return lambda: self._events.put(lambda: self._forget(key))

    def _forget(self, key: int) -> None:
        self._listeners.pop(key, None)
        self._process_listeners.pop(key, None)

    def listen_to_processes(self, listener: ProcessListener) -> Callable[[], None]:
        """Have rosz nodes told as they come and go, those that are alive first.

        Args:
            listener: Gets each on the graph's thread; what it raises is logged.

        Returns:
            A function that ends it.
        """
        key = id(listener)

        def begin() -> None:
            for process in list(self._processes.values()):
                _tell(listener, process, process.node, alive=True)
            self._process_listeners[key] = listener

        self._events.put(begin)
        return lambda: self._events.put(lambda: self._forget(key))

    def wait_for(
        self, condition: Callable[[View], bool], timeout: float, what: str, hint: str = ""
    ) -> View:
        """Wait until the graph is as wished.

        Args:
            condition: Tells whether it is.
            timeout: Seconds.
            what: Name of the thing waited for, for the error.
            hint: What to do when it does not come, for the error.

        Returns:
            The view that met the condition.

        Raises:
            WaitTimeout: It did not become so in time.
            ClosedError: The graph was closed meanwhile.
        """
        deadline = time.monotonic() + timeout
        with self._changed:
            while True:
                view = View(self._tokens.values())
                if condition(view):
                    return view
                left = deadline - time.monotonic()
                if left <= 0:
                    raise WaitTimeout(what, timeout, hint)
                if self._closed:
                    raise ClosedError(f"the wait for {what} ended: shutting down")
                self._changed.wait(left)

    def wait_for_node(self, name: str, timeout: float) -> View:
        """Wait for a node of that full name.

        Raises:
            WaitTimeout: It did not appear in time.
        """
        return self._wait_for_name(
            lambda view: name in view.nodes(), timeout, f"node '{name}'", name, View.nodes
        )

    def wait_for_topic(self, name: str, timeout: float) -> View:
        """Wait for a publisher of that topic.

        Raises:
            WaitTimeout: None appeared in time.
        """
        return self._wait_for_name(
            lambda view: bool(view.publishers(name)),
            timeout,
            f"publisher of '{name}'",
            name,
            View.topics,
        )

    def wait_for_service(self, name: str, timeout: float) -> View:
        """Wait for somebody who serves that service.

        Raises:
            WaitTimeout: Nobody did in time.
        """
        return self._wait_for_name(
            lambda view: bool(view.servers(name)),
            timeout,
            f"service '{name}'",
            name,
            View.services,
        )

    def wait_for_subscribers(self, topic: str, count: int, timeout: float) -> View:
        """Wait until a topic has at least so many subscriptions.

        Raises:
            WaitTimeout: It had fewer when the time was over.
        """
        return self.wait_for(
            lambda view: len(view.subscriptions(topic)) >= count,
            timeout,
            f"{count} subscriber(s) of '{topic}'",
        )

    def _wait_for_name(
        self,
        condition: Callable[[View], bool],
        timeout: float,
        what: str,
        name: str,
        kin: Callable[[View], Iterable[str]],
    ) -> View:
        try:
            return self.wait_for(condition, timeout, what)
        except WaitTimeout as error:
            hint = near_miss(name, kin(self.view())).removeprefix("; ")
            raise WaitTimeout(what, timeout, hint) from error

    def _run(self) -> None:
        while (event := self._events.get()) is not None:
            if isinstance(event, tuple):
                self._apply(*event)
            else:
                event()

    def _apply(self, key: str, alive: bool) -> None:
        ours = key.startswith(OWN_SPACE)
        known: dict[str, Any] = self._processes if ours else self._tokens
        if alive == (key in known):
            return
        if alive:
            try:
                token: Token | ProcessToken = parse_process(key) if ours else parse_token(key)
            except DecodeError as error:
                _log.warning("ignoring a foreign liveliness token: %s", error)
                return
        with self._changed:
            if alive:
                known[key] = token
            else:
                token = known.pop(key)
            self._changed.notify_all()
        if isinstance(token, ProcessToken):
            for tell in list(self._process_listeners.values()):
                _tell(tell, token, token.node, alive=alive)
        else:
            for listener in list(self._listeners.values()):
                _tell(listener, token, token.node_name, alive=alive)

    def close(self) -> None:
        """Stop following; waiters are woken with `ClosedError`. Again is no error."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._changed.notify_all()
        for watch in self._watches:
            watch.close()
        self._events.put(None)


def _tell(listener: Callable[[Any, bool], None], token: object, node: str, *, alive: bool) -> None:
    try:
        listener(token, alive)
    except Exception:  # noqa: BLE001  # the callback boundary
        _log.exception("a graph listener failed on node '%s'", node)
