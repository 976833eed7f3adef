"""The live view of a domain.

Zenoh's thread only queues what it sees. One thread of the graph applies it, wakes waiters and runs
listeners. A listener that waits for the graph applies what comes meanwhile itself, so it may call
anything; but all listeners are told of that only when it returns, so that each is told of things in
their order, and what takes long belongs on another thread.
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
"""Gets a token, and whether it appeared (true) or went (false)."""

ProcessListener = Callable[[ProcessToken, bool], None]
"""Gets a rosz node as a process, and whether it appeared (true) or went (false)."""

_Telling = Callable[[], object]
"""What is done when all that came before has been told."""

_LOOK_TIMEOUT = 2.0
_CLOSED_POLL = 0.1
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
        self._view: View | None = None
        self._changed = threading.Condition()
        self._numbers = itertools.count()
        self._listeners: dict[int, GraphListener] = {}
        self._process_listeners: dict[int, ProcessListener] = {}
        self._complained: set[str] = set()
        self._events: SimpleQueue[tuple[str, bool] | Callable[[], _Telling | None] | None]
        self._events = SimpleQueue()
        self._untold: deque[_Telling] = deque()
        self._telling = False
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="rosz-graph", daemon=True)
        self._thread.start()
        # In this order: once tokens are watched, Zenoh answers from what the watch has seen so far.
        for space in (tokens_key(domain), processes_key(domain)):
            for key in session.live_tokens(space, _LOOK_TIMEOUT):
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
        """Return the rosz nodes with their processes, sorted by name; ROS 2 tells none."""
        return self.view().processes()

    def refresh(self, timeout: float = 2.0) -> View:
        """Ask the network for all tokens, for who cannot wait for them to come by themselves.

        Args:
            timeout: Seconds.

        Returns:
            What is known, with what the answers add.

        Raises:
            ClosedError: The session is closed.
            WaitTimeout: No end of answers.
            UsageError: The timeout is no number.
        """
        timeout = clamp_timeout(timeout)
        asked = [
            *self._session.live_tokens(tokens_key(self.domain), timeout),
            *self._session.live_tokens(processes_key(self.domain), timeout),
        ]
        self._catch_up(timeout)
        with self._changed:
            tokens, processes = dict(self._tokens), dict(self._processes)
        # Not for good: one that ended meanwhile may never be told to have gone.
        for key in asked:
            known: dict[str, Any] = processes if key.startswith(OWN_SPACE) else tokens
            if key not in known and (token := self._parse(key)) is not None:
                known[key] = token
        return View(tokens.values(), processes.values())

    def listen(self, listener: GraphListener, *, history: bool = True) -> Callable[[], None]:
        """Have every change told, in order, on the graph's thread.

        Args:
            listener: Gets each token that appears or goes; what it raises is logged.
            history: Whether to tell what is alive already, first.

        Returns:
            A function that ends it.
        """
        return self._enlist(self._listeners, listener, self._tokens if history else {})

    def listen_to_processes(self, listener: ProcessListener) -> Callable[[], None]:
        """Have rosz nodes told as they come and go, those that are alive first.

        Args:
            listener: Gets each on the graph's thread; what it raises is logged.

        Returns:
            A function that ends it.
        """
        return self._enlist(self._process_listeners, listener, self._processes)

    def _enlist(
        self,
        listeners: dict[int, Any],
        listener: Callable[[Any, bool], None],
        known: dict[str, Any],
    ) -> Callable[[], None]:
        number = next(self._numbers)

        def begin(alive: list[Any]) -> None:
            listeners[number] = listener
            for token in alive:
                self._tell(listeners, number, token, alive=True)

        self._events.put(lambda: partial(begin, list(known.values())))
        return lambda: self._events.put(lambda: partial(listeners.pop, number, None))

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
            UsageError: The timeout is no number.
        """
        deadline = time.monotonic() + clamp_timeout(timeout)
        wait = self._apply_next if threading.current_thread() is self._thread else self._sleep
        while not condition(view := self.view()):
            left = deadline - time.monotonic()
            if self._closed:
                raise ClosedError(f"the wait for {what} ended: shutting down")
            if left <= 0:
                raise WaitTimeout(what, timeout, hint)
            wait(view, left)
        return view

    def _sleep(self, seen: View, timeout: float) -> None:
        """Wait until the view is another than the one that was looked at."""
        with self._changed:
            self._changed.wait_for(lambda: self._view is not seen or self._closed, timeout)

    def _apply_next(self, _seen: View, timeout: float) -> None:
        """Do the graph thread's work on that very thread, which is in a listener that waits."""
        try:
            event = self._events.get(timeout=timeout)
        except Empty:
            return
        if event is None:
            self._events.put(None)
        else:
            self._do(event)

    def wait_for_node(self, name: str, timeout: float) -> View:
        """Wait for a node of that full name.

        Raises:
            WaitTimeout: It did not appear in time.
            ClosedError: The graph was closed meanwhile.
        """
        return self._wait_for_name(
            lambda view: name in view.nodes(), timeout, f"node '{name}'", name, View.nodes
        )

    def wait_for_topic(self, name: str, timeout: float) -> View:
        """Wait for a publisher of that topic.

        Raises:
            WaitTimeout: None appeared in time.
            ClosedError: The graph was closed meanwhile.
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
            ClosedError: The graph was closed meanwhile.
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
            ClosedError: The graph was closed meanwhile.
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
            self._do(event)

    def _do(self, event: tuple[str, bool] | Callable[[], _Telling | None]) -> None:
        """Take an event in, and tell of it unless a listener is being told of another one."""
        telling = self._apply(event[0], alive=event[1]) if isinstance(event, tuple) else event()
        if telling is None:
            return
        self._untold.append(telling)
        if self._telling:
            return
        self._telling = True
        while self._untold:
            self._untold.popleft()()
        self._telling = False

    def _catch_up(self, timeout: float) -> None:
        """Wait until what came so far is applied."""
        if threading.current_thread() is self._thread:
            return  # it is in a listener, which is told of things in their order
        applied = threading.Event()
        self._events.put(applied.set)
        while not (self._closed or applied.wait(min(timeout, _CLOSED_POLL))):
            timeout -= _CLOSED_POLL
            if timeout <= 0:
                return

    def _apply(self, key: str, *, alive: bool) -> _Telling | None:
        """Take note of a token that appeared or went, and return what tells of it if it is news."""
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
            self._tell_all, self._process_listeners if ours else self._listeners, token, alive
        )

    def _tell_all(
        self, listeners: dict[int, Any], token: Token | ProcessToken, alive: bool
    ) -> None:
        for number in list(listeners):
            self._tell(listeners, number, token, alive=alive)

    def _parse(self, key: str) -> Token | ProcessToken | None:
        """Read a token; one that is damaged is told of, once per kind of damage."""
        try:
            return parse_process(key) if key.startswith(OWN_SPACE) else parse_token(key)
        except DecodeError as error:
            if error.type_name not in self._complained:
                self._complained.add(error.type_name)
                _log.warning(
                    "ignoring foreign tokens with a damaged %s (told once): %.300s",
                    error.type_name,
                    error.reason,
                )
            return None

    def _tell(
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
            # What a listener tries while all is being shut down is no fault of its.
            if not self._closed:
                _log.exception("a graph listener failed", exc_info=error)
        except BaseException:  # noqa: BLE001  # the graph outlives what a listener raises
            _log.exception("a graph listener failed on %s", token)

    def disown(self) -> None:
        """Know nothing and wait for nothing from now on: after a fork, in the child."""
        self._changed = threading.Condition()
        self._closed = True

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
