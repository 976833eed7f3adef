"""The live view of a domain: its nodes and their entities.

Zenoh only queues the tokens that appear and disappear. One thread of the graph applies them, wakes
waiters and calls listeners. A listener that waits for the graph applies further tokens itself, so
it may call anything. But listeners hear of these only after it has returned, so that each is told
of changes in their order. Long work therefore belongs on another thread.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, DecodeError, WaitTimeout, near_miss
from rosz.graph.view import View
from rosz.lifecycle import Lifecycle
from rosz.session import clamp_timeout
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
"""Function called with a token, and whether it appeared (true) or disappeared (false)."""

ProcessListener = Callable[[ProcessToken, bool], None]
"""Function called with a rosz node as a process, and whether it appeared or disappeared."""

_Report = Callable[[], object]
"""Function that tells listeners of one change."""

_QUERY_TIMEOUT = 2.0
_POLL_SECONDS = 0.1
_log = logging.getLogger("rosz.graph")


class Graph:
    """The nodes and entities of a domain, followed as they come and go.

    Args:
        session: The session to watch tokens with.
        domain: The ROS domain.

    Attributes:
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self.domain = domain
        self._session = session
        self._tokens: dict[str, Token] = {}
        self._processes: dict[str, ProcessToken] = {}
        self._view: View | None = None
        self._changed = threading.Condition()
        self._numbers = itertools.count()
        self._listeners: dict[int, GraphListener] = {}
        self._process_listeners: dict[int, ProcessListener] = {}
        self._reported_damage: set[str] = set()
        self._events: SimpleQueue[tuple[str, bool] | Callable[[], _Report | None] | None]
        self._events = SimpleQueue()
        self._reports: deque[_Report] = deque()
        self._reporting = False
        self._lifecycle = Lifecycle("the graph", log=_log, on_fork=self._replace_lock)
        self._thread = threading.Thread(target=self._run, name="rosz-graph", daemon=True)
        self._thread.start()
        # In this order: once tokens are watched, Zenoh replies from what the watch has seen so far.
        for space in (tokens_key(domain), processes_key(domain)):
            for key in session.live_tokens(space, _QUERY_TIMEOUT):
                self._apply(key, alive=True)
        self._watches = [
            session.watch_tokens(key, lambda key, alive: self._events.put((key, alive)))
            for key in (tokens_key(domain), processes_key(domain))
        ]

    def view(self) -> View:
        """Return what is known at this moment."""
        known = self._view  # replaced whole, so that reading it needs no lock
        if known is not None:
            return known
        with self._changed:
            if self._view is None:
                self._view = View(self._tokens.values(), self._processes.values())
            return self._view

    def processes(self) -> list[ProcessToken]:
        """Return the rosz nodes with their processes, sorted by name; ROS 2 announces none."""
        return self.view().processes()

    def refresh(self, timeout: float = 2.0) -> View:
        """Query the network for all tokens, for callers that cannot wait until these arrive.

        Args:
            timeout: Time limit in seconds.

        Returns:
            What is known, with what the replies add.

        Raises:
            ClosedError: The session is closed.
            UsageError: The timeout is not a number.
        """
        timeout = clamp_timeout(timeout)
        found = [
            *self._session.live_tokens(tokens_key(self.domain), timeout),
            *self._session.live_tokens(processes_key(self.domain), timeout),
        ]
        self._apply_pending(timeout)
        with self._changed:
            tokens, processes = dict(self._tokens), dict(self._processes)
        # Only in the result: nothing may report the end of a token that was never watched.
        for key in found:
            known: dict[str, Any] = processes if key.startswith(OWN_SPACE) else tokens
            if key not in known and (token := self._parse(key)) is not None:
                known[key] = token
        return View(tokens.values(), processes.values())

    def listen(self, listener: GraphListener, *, history: bool = True) -> Callable[[], None]:
        """Call a function for every change, in order, on the graph's thread.

        Args:
            listener: Function called with each token that appears or disappears; exceptions are
                logged.
            history: Whether to call it for existing tokens first.

        Returns:
            A function that unregisters the listener.
        """
        return self._register(self._listeners, listener, self._tokens if history else {})

    def listen_to_processes(self, listener: ProcessListener) -> Callable[[], None]:
        """Call a function for every rosz node that exists, appears or disappears.

        Args:
            listener: Function called on the graph's thread; exceptions are logged.

        Returns:
            A function that unregisters the listener.
        """
        return self._register(self._process_listeners, listener, self._processes)

    def _register(
        self,
        listeners: dict[int, Any],
        listener: Callable[[Any, bool], None],
        known: dict[str, Any],
    ) -> Callable[[], None]:
        number = next(self._numbers)

        def begin(tokens: list[Any]) -> None:
            listeners[number] = listener
            for token in tokens:
                self._notify(listeners, number, token, alive=True)

        self._events.put(lambda: partial(begin, list(known.values())))
        return lambda: self._events.put(lambda: partial(listeners.pop, number, None))

    def wait_for(
        self, condition: Callable[[View], bool], timeout: float, what: str, hint: str = ""
    ) -> View:
        """Wait until the graph meets a condition.

        Args:
            condition: Function that tells whether a view meets it.
            timeout: Time limit in seconds.
            what: Name of the condition, for the error.
            hint: Advice at the end of the error text.

        Returns:
            The view that met the condition.

        Raises:
            WaitTimeout: The time limit was reached.
            ClosedError: The graph was closed meanwhile.
            UsageError: The timeout is not a number.
        """
        deadline = time.monotonic() + clamp_timeout(timeout)
        wait = self._apply_next if threading.current_thread() is self._thread else self._sleep
        while not condition(view := self.view()):
            left = deadline - time.monotonic()
            if self._lifecycle.closing:
                raise ClosedError(f"the wait for {what} ended: shutting down")
            if left <= 0:
                raise WaitTimeout(what, timeout, hint)
            wait(view, left)
        return view

    def _sleep(self, seen: View, timeout: float) -> None:
        """Wait until there is another view than the one that was seen."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._view is not seen or self._lifecycle.closing, timeout
            )

    def _apply_next(self, _seen: View, timeout: float) -> None:
        """Handle an event on the graph's thread, while a listener on that thread waits."""
        try:
            event = self._events.get(timeout=timeout)
        except Empty:
            return
        if event is None:
            self._events.put(None)
        else:
            self._handle(event)

    def wait_for_node(self, name: str, timeout: float) -> View:
        """Wait for the node of a full name; the errors are those of `wait_for`."""
        return self._wait_for_name(
            lambda view: name in view.nodes(), timeout, f"node '{name}'", name, View.nodes
        )

    def wait_for_topic(self, name: str, timeout: float) -> View:
        """Wait for a publisher of a topic; the errors are those of `wait_for`."""
        return self._wait_for_name(
            lambda view: bool(view.publishers(name)),
            timeout,
            f"publisher of '{name}'",
            name,
            View.topics,
        )

    def wait_for_service(self, name: str, timeout: float) -> View:
        """Wait for a server of a service; the errors are those of `wait_for`."""
        return self._wait_for_name(
            lambda view: bool(view.servers(name)),
            timeout,
            f"service '{name}'",
            name,
            View.services,
        )

    def wait_for_subscribers(self, topic: str, count: int, timeout: float) -> View:
        """Wait for a number of subscriptions of a topic; the errors are those of `wait_for`."""
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
        names: Callable[[View], Iterable[str]],
    ) -> View:
        try:
            return self.wait_for(condition, timeout, what)
        except WaitTimeout as error:
            hint = near_miss(name, names(self.view())).removeprefix("; ")
            raise WaitTimeout(what, timeout, hint) from error

    def _run(self) -> None:
        while (event := self._events.get()) is not None:
            self._handle(event)

    def _handle(self, event: tuple[str, bool] | Callable[[], _Report | None]) -> None:
        """Apply an event, and report it unless a listener is running that was told of another."""
        report = self._apply(event[0], alive=event[1]) if isinstance(event, tuple) else event()
        if report is None:
            return
        self._reports.append(report)
        if self._reporting:
            return
        self._reporting = True
        while self._reports:
            self._reports.popleft()()
        self._reporting = False

    def _apply_pending(self, timeout: float) -> None:
        """Wait until the events that are queued now have been applied."""
        if threading.current_thread() is self._thread:
            return  # in a listener, which is told of changes in their order
        applied = threading.Event()
        self._events.put(applied.set)
        while not (self._lifecycle.closing or applied.wait(min(timeout, _POLL_SECONDS))):
            timeout -= _POLL_SECONDS
            if timeout <= 0:
                return

    def _apply(self, key: str, *, alive: bool) -> _Report | None:
        """Add or remove a token, and return the report of it if that is a change."""
        ours = key.startswith(OWN_SPACE)
        known: dict[str, Any] = self._processes if ours else self._tokens
        if alive == (key in known):
            return None
        token = self._parse(key) if alive else known[key]
        if token is None:
            return None
        with self._changed:
            if alive:
                known[key] = token
            else:
                del known[key]
            self._view = None
            self._changed.notify_all()
        return partial(
            self._notify_all, self._process_listeners if ours else self._listeners, token, alive
        )

    def _parse(self, key: str) -> Token | ProcessToken | None:
        """Parse a token; each kind of damage is logged once."""
        try:
            return parse_process(key) if key.startswith(OWN_SPACE) else parse_token(key)
        except DecodeError as error:
            if error.type_name not in self._reported_damage:
                self._reported_damage.add(error.type_name)
                _log.warning(
                    "ignoring foreign tokens with a damaged %s (told once): %.300s",
                    error.type_name,
                    error.reason,
                )
            return None

    def _notify_all(
        self, listeners: dict[int, Any], token: Token | ProcessToken, alive: bool
    ) -> None:
        for number in list(listeners):
            self._notify(listeners, number, token, alive=alive)

    def _notify(
        self,
        listeners: dict[int, Callable[[Any, bool], None]],
        number: int,
        token: Token | ProcessToken,
        *,
        alive: bool,
    ) -> None:
        listener = listeners.get(number)
        if listener is None:
            return
        try:
            listener(token, alive)
        except ClosedError as error:
            # A listener cannot know that the graph is being closed.
            if not self._lifecycle.closing:
                _log.exception("a graph listener failed", exc_info=error)
        except BaseException:  # noqa: BLE001  # the graph outlives what a listener raises
            _log.exception("a graph listener failed on %s", token)

    def close(self) -> None:
        """Stop following, and wake waiters with `ClosedError`; a second call has no effect."""
        self._lifecycle.close(self._finish)

    def _finish(self) -> None:
        with self._changed:
            self._changed.notify_all()
        for watch in self._watches:
            watch.close()
        self._events.put(None)

    def _replace_lock(self) -> None:
        """Replace the lock in a forked child: a thread of the parent may hold it for ever."""
        self._changed = threading.Condition()
