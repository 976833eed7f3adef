"""The live view of a domain: its nodes and their entities.

Somebody who needs to know of some names follows the tokens of these alone (`Graph.follow`), because
the tokens of all would grow with the square of the number of nodes. `Graph.view`, `Graph.listen`
and `Graph.wait_for` follow the whole domain: the first for good, the others while they need it.

Zenoh only queues the tokens that appear and disappear. One thread of the graph applies them, wakes
waiters and calls listeners. A listener that waits for the graph applies further tokens itself, so
it may call anything. But listeners hear of these only after it has returned, so that each is told
of changes in their order. Long work therefore belongs on another thread.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, DecodeError, WaitTimeout, near_miss
from rosz.graph.followed import COMPLETE_BY, Followed, GraphListener, Interest, ProcessListener
from rosz.graph.view import View
from rosz.lifecycle import Lifecycle
from rosz.session import clamp_timeout
from rosz.wire import (
    OWN_SPACE,
    Kind,
    ProcessToken,
    Token,
    entities_key,
    node_key,
    parse_process,
    parse_token,
    processes_key,
    tokens_key,
)

if TYPE_CHECKING:
    from rosz.session import Session

__all__ = ("Graph",)

_Report = Callable[[], object]
"""Function that tells listeners of one change."""

_Task = Callable[[], _Report | None]
"""Function that runs on the thread of the graph."""

_HINT_TIMEOUT = 1.0
_POLL_SECONDS = 0.1
_log = logging.getLogger("rosz.graph")


class Graph:
    """The nodes and entities of a domain, followed as they come and go.

    Args:
        session: The session to watch tokens with.
        domain: The ROS domain.

    Attributes:
        domain: The ROS domain.
        changed: Condition that is notified of each change.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self.domain = domain
        self.changed: threading.Condition = threading.Condition()
        self._session = session
        self._version = 0
        self._interests: dict[str, Interest] = {}
        self._whole: Followed | None = None
        self._reported_damage: set[str] = set()
        self._events: SimpleQueue[tuple[Interest, str, bool] | _Task | None] = SimpleQueue()
        self._reports: deque[_Report] = deque()
        self._reporting = False
        self._lifecycle = Lifecycle("the graph", log=_log, on_fork=self._replace_lock)
        self._thread = threading.Thread(target=self._run, name="rosz-graph", daemon=True)
        self._thread.start()

    def follow(self, *keys: str) -> Followed:
        """Follow the tokens that match some key expressions, such as `rosz.wire.nodes_key`.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return self._follow((key, "") for key in keys)

    def follow_entities(self, kind: Kind, *names: str) -> Followed:
        """Follow one kind of entity of some topics or services.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return self._follow((entities_key(self.domain, kind, name), name) for name in names)

    def _follow(self, keys: Iterable[tuple[str, str]]) -> Followed:
        self._lifecycle.check_open("follow anything more")
        interests: list[Interest] = []
        try:
            interests.extend(self._acquire(*key) for key in keys)
        except BaseException:
            self.release(interests)
            raise
        return Followed(self, interests)

    def follow_all(self) -> Followed:
        """Follow the whole domain, which costs each node as much as there are entities in all.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return self.follow(*self._all_keys())

    def view(self) -> View:
        """Return all that is known at this moment, and follow the whole domain from now on.

        The first call waits, at most 2 seconds, until everything is known that exists.

        Raises:
            ClosedError: The graph was closed before the first call.
        """
        if self._whole is None:
            self._whole = self.follow_all()  # of two threads, both may: that costs no other watch
        followed = self._whole
        if not followed.complete:
            self.wait_until(lambda: followed.complete, time.monotonic() + COMPLETE_BY)
        return followed.view()

    def refresh(self, timeout: float = 2.0) -> View:
        """Query the network for all tokens, for callers that need them just once.

        Args:
            timeout: Time limit in seconds.

        Returns:
            All nodes and entities.

        Raises:
            ClosedError: The session is closed.
            UsageError: The timeout is not a number.
        """
        with self.changed:
            interests = list(self._interests.values())
        return self.query(interests, self._all_keys(), timeout)

    def listen(self, listener: GraphListener, *, history: bool = True) -> Callable[[], None]:
        """Call a function for every change in the whole domain, in order, on the graph's thread.

        Args:
            listener: Function called with each token that appears or disappears; exceptions are
                logged.
            history: Whether to call it for existing tokens first.

        Returns:
            A function that unregisters the listener.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return self._listen(tokens_key(self.domain), listener, history=history)

    def listen_to_processes(self, listener: ProcessListener) -> Callable[[], None]:
        """Call a function for every rosz node that exists, appears or disappears.

        Args:
            listener: Function called on the graph's thread; exceptions are logged.

        Returns:
            A function that unregisters the listener.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return self._listen(processes_key(self.domain), listener, history=True)

    def _listen(
        self, key: str, listener: Callable[[Any, bool], None], *, history: bool
    ) -> Callable[[], None]:
        followed = self.follow(key)
        unregister = followed.listen(listener, history=history)

        def stop() -> None:
            unregister()
            followed.close()

        return stop

    def wait_for(
        self, condition: Callable[[View], bool], timeout: float, what: str, hint: str = ""
    ) -> View:
        """Wait until the graph meets a condition, following the whole domain meanwhile.

        See `Followed.wait_for`.
        """
        with self.follow_all() as followed:
            return followed.wait_for(condition, timeout, what, hint)

    def wait_for_node(self, name: str, timeout: float) -> View:
        """Wait for the node of a full name; the errors are those of `wait_for`."""
        with self.follow(node_key(self.domain, name)) as followed:
            return self._wait_for_name(
                followed,
                lambda view: name in view.nodes(),
                timeout,
                f"node '{name}'",
                name,
                View.nodes,
            )

    def wait_for_topic(self, name: str, timeout: float) -> View:
        """Wait for a publisher of a topic; the errors are those of `wait_for`."""
        with self.follow_entities(Kind.PUBLISHER, name) as followed:
            return self._wait_for_name(
                followed,
                lambda view: bool(view.publishers(name)),
                timeout,
                f"publisher of '{name}'",
                name,
                View.topics,
            )

    def wait_for_service(self, name: str, timeout: float) -> View:
        """Wait for a server of a service; the errors are those of `wait_for`."""
        with self.follow_entities(Kind.SERVICE, name) as followed:
            return self._wait_for_name(
                followed,
                lambda view: bool(view.servers(name)),
                timeout,
                f"service '{name}'",
                name,
                View.services,
            )

    def wait_for_subscribers(self, topic: str, count: int, timeout: float) -> View:
        """Wait for a number of subscriptions of a topic; the errors are those of `wait_for`."""
        with self.follow_entities(Kind.SUBSCRIPTION, topic) as followed:
            return followed.wait_for(
                lambda view: len(view.subscriptions(topic)) >= count,
                timeout,
                f"{count} subscriber(s) of '{topic}'",
            )

    def _wait_for_name(
        self,
        followed: Followed,
        condition: Callable[[View], bool],
        timeout: float,
        what: str,
        name: str,
        names: Callable[[View], Iterable[str]],
    ) -> View:
        try:
            return followed.wait_for(condition, timeout, what)
        except WaitTimeout as error:
            known = names(self.refresh(_HINT_TIMEOUT))
            raise WaitTimeout(what, timeout, near_miss(name, known).removeprefix("; ")) from error

    # What a `Followed` needs.

    @property
    def closing(self) -> bool:
        """Whether the graph is closed, or being closed."""
        return self._lifecycle.closing

    def query(self, interests: Sequence[Interest], keys: Iterable[str], timeout: float) -> View:
        """Return what is known of some interests, with what a query for some keys adds."""
        timeout = clamp_timeout(timeout)
        # What a watch is told of while the query runs is missing in the replies.
        self.wait_until(lambda: all(one.settled for one in interests), time.monotonic() + timeout)
        found = [token for key in keys for token in self._session.live_tokens(key, timeout)]
        self._apply_pending(timeout)
        with self.changed:
            known = {key: token for one in interests for key, token in one.tokens.items()}
        # Only in the result: nothing may report the end of a token that was never watched.
        for key in found:
            if key not in known and (token := self._parse(key)) is not None:
                known[key] = token
        return View.of(known.values())

    def register(
        self,
        interest: Interest,
        number: int,
        listener: Callable[[Any, bool], None],
        *,
        history: bool,
    ) -> None:
        """Call a listener for what is known of an interest, and for each change of it."""

        def begin(tokens: list[Any]) -> None:
            interest.listeners[number] = listener, history
            for token in tokens:
                self._notify(interest, number, token, alive=True)

        def register() -> _Report:
            return partial(begin, list(interest.tokens.values()) if history else [])

        self._events.put(register)

    def unregister(self, interest: Interest, number: int) -> None:
        """Call a listener of an interest no longer."""
        self._events.put(lambda: partial(interest.listeners.pop, number, None))

    def wait_until(self, condition: Callable[[], bool], deadline: float) -> bool:
        """Wait until a condition holds, which is checked after each change.

        Args:
            condition: The condition.
            deadline: Time to give up, by the monotonic clock in seconds.

        Returns:
            Whether it holds; false if the time is up, or the graph closed.
        """
        wait = self._apply_next if threading.current_thread() is self._thread else self._sleep
        while True:
            version = self._version
            if condition():
                return True
            left = deadline - time.monotonic()
            if self._lifecycle.closing or left <= 0:
                return False
            wait(version, min(left, COMPLETE_BY))

    def release(self, interests: Iterable[Interest]) -> None:
        """Close the watches of interests that nobody follows any more."""
        unused = []
        with self.changed:
            for interest in interests:
                interest.users -= 1
                if not interest.users and self._interests.get(interest.key) is interest:
                    unused.append(self._interests.pop(interest.key))
        for interest in unused:
            if interest.watch is not None:
                interest.watch.close()

    # The rest.

    def _all_keys(self) -> tuple[str, str]:
        return tokens_key(self.domain), processes_key(self.domain)

    def _acquire(self, key: str, name: str) -> Interest:
        with self.changed:
            interest = self._interests.get(key)
            if interest is not None:
                interest.users += 1
                return interest
            interest = self._interests[key] = Interest(key, name)
            interest.users = 1
        try:
            interest.watch = self._session.watch_tokens(
                key,
                lambda token, alive: self._events.put((interest, token, alive)),
                lambda: self._events.put(partial(self._set_complete, interest)),
            )
        except BaseException:
            self.release([interest])
            raise
        if self._lifecycle.closing:  # perhaps too late for the thread that closes the graph
            interest.watch.close()
        return interest

    def _set_complete(self, interest: Interest) -> None:
        with self.changed:
            interest.complete = True
            self._version += 1
            self.changed.notify_all()

    def _sleep(self, seen: int, timeout: float) -> None:
        """Wait until there is another version than the one that was seen."""
        with self.changed:
            self.changed.wait_for(lambda: self._version != seen or self._lifecycle.closing, timeout)

    def _apply_next(self, _seen: int, timeout: float) -> None:
        """Handle an event on the graph's thread, while a listener on that thread waits."""
        try:
            event = self._events.get(timeout=timeout)
        except Empty:
            return
        if event is None:
            self._events.put(None)
        else:
            self._handle(event)

    def _run(self) -> None:
        while (event := self._events.get()) is not None:
            self._handle(event)

    def _handle(self, event: tuple[Interest, str, bool] | _Task) -> None:
        """Apply an event, and report it unless a listener is running that was told of another."""
        report = self._apply(*event) if isinstance(event, tuple) else event()
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

    def _apply(self, interest: Interest, key: str, alive: bool) -> _Report | None:
        """Add or remove a token, and return the report of it if that is a change."""
        known = interest.tokens
        if alive == (key in known):
            return None
        token = self._parse(key) if alive else known[key]
        if token is None or interest.name not in {"", getattr(token, "name", "")}:
            return None
        with self.changed:
            if alive:
                known[key] = token
            else:
                del known[key]
            interest.version += 1
            self._version += 1
            self.changed.notify_all()
        return partial(self._notify_all, interest, token, alive, alive and not interest.settled)

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
        self, interest: Interest, token: Token | ProcessToken, alive: bool, existed: bool
    ) -> None:
        for number, (_, history) in list(interest.listeners.items()):
            if history or not existed:
                self._notify(interest, number, token, alive=alive)

    def _notify(
        self, interest: Interest, number: int, token: Token | ProcessToken, *, alive: bool
    ) -> None:
        listener, _ = interest.listeners.get(number, (None, True))
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
        with self.changed:
            self.changed.notify_all()
            interests = list(self._interests.values())
        for interest in interests:
            if interest.watch is not None:
                interest.watch.close()
        self._events.put(None)

    def _replace_lock(self) -> None:
        """Replace the lock in a forked child: a thread of the parent may hold it for ever."""
        self.changed = threading.Condition()
