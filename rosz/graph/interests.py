"""The followed parts of a graph: tokens of key expressions, and the thread that applies them."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

import msgspec

from rosz.errors import ClosedError, DecodeError
from rosz.graph.view import View
from rosz.lifecycle import Closable, Lifecycle
from rosz.session import Session, clamp_timeout
from rosz.wire import (
    OWN_SPACE,
    ProcessToken,
    Token,
    entities_key,
    parse_process,
    parse_token,
    processes_key,
)

COMPLETE_BY = 2.0
"""Seconds after which an interest counts as complete in any case."""

_Report = Callable[[], object]
"""Function that tells listeners of one change."""

_Task = Callable[[], _Report | None]
"""Function that runs on the thread of the graph."""

_POLL_SECONDS = 0.1
_log = logging.getLogger("rosz.graph")


class Interest(msgspec.Struct, eq=False):
    """The live tokens that match one key expression, for all who follow it.

    Only the graph changes it, on its thread.

    Attributes:
        key: The key expression.
        name: The topic, service or process's node that the tokens must have; any if empty.
        is_part: Whether it has no watch, but gets its tokens from interests in the whole domain.
        tokens: The tokens by their keys.
        version: Number that grows with each change of the tokens.
        began: Time when it was made, by the monotonic clock in seconds.
        complete: Whether it has the tokens that existed when it began.
        users: Number of those who follow it.
        listeners: Functions called with each change.
        watch: The watch of the session, once it is declared.
    """

    key: str
    name: str = ""
    is_part: bool = False
    tokens: dict[str, Any] = {}
    version: int = 0
    began: float = msgspec.field(default_factory=time.monotonic)
    complete: bool = False
    users: int = 0
    listeners: dict[int, Callable[[Any, bool], None]] = {}
    watch: Closable | None = None

    @property
    def settled(self) -> bool:
        """Whether it has the tokens that existed at its beginning, or that takes too long."""
        return self.complete or time.monotonic() - self.began > COMPLETE_BY


class Interests:
    """All interests of one graph, by their key expressions.

    Args:
        session: The session to watch tokens with.

    Attributes:
        changed: Condition that is notified of each change.
    """

    def __init__(self, session: Session) -> None:
        self.changed: threading.Condition = threading.Condition()
        self._session = session
        self._version = 0
        self._interests: dict[str, Interest] = {}
        self._whole: tuple[Interest, ...] = ()
        self._reported_damage: set[str] = set()
        self._events: SimpleQueue[tuple[Interest, str, bool] | _Task | None] = SimpleQueue()
        self._reports: deque[_Report] = deque()
        self._reporting = False
        self._lifecycle = Lifecycle("the graph", log=_log, on_fork=self._replace_lock)
        self._thread = threading.Thread(target=self._run, name="rosz-graph", daemon=True)
        self._thread.start()

    def all(self) -> list[Interest]:
        """Return all that somebody follows now."""
        with self.changed:
            return list(self._interests.values())

    def acquire(self, keys: Iterable[tuple[str, str]], *, many: bool) -> list[Interest]:
        """Follow the tokens that match some key expressions, until `release`.

        Args:
            keys: The key expressions, each with the name that the tokens must have, or none.
            many: Whether hundreds of tokens may match each of them.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        self._lifecycle.check_open("follow anything more")
        interests: list[Interest] = []
        try:
            interests.extend(self._acquire(*key, many) for key in keys)
        except BaseException:
            self.release(interests)
            raise
        return interests

    def draw_on(self, whole: Iterable[Interest]) -> None:
        """Take the tokens of single names from interests that stay, from now on.

        A watch costs two threads.

        Args:
            whole: Interests in the whole domain, which are never released.
        """
        self._whole = tuple(whole)

    @property
    def closing(self) -> bool:
        """Whether the graph is closed, or being closed."""
        return self._lifecycle.closing

    def query(self, interests: Sequence[Interest], keys: Iterable[str], timeout: float) -> View:
        """Return the tokens of some interests, and those of a query for some keys."""
        timeout = clamp_timeout(timeout)
        # A token that a watch receives while the query runs may be missing in the replies.
        self.wait_until(
            lambda: all(interest.settled for interest in interests), time.monotonic() + timeout
        )
        live = [token for key in keys for token in self._session.live_tokens(key, timeout)]
        self._apply_pending(timeout)
        tokens = self._known(interests)
        # Only in the result: nothing may report the end of a token that was never watched.
        for key in live:
            if key not in tokens and (token := self._parse(key)) is not None:
                tokens[key] = token
        return View.of(tokens.values())

    def known(self) -> View:
        """Return the tokens of all interests, or those at the closing of the graph."""
        return View.of(self._known(self.all()).values())

    def _known(self, interests: Iterable[Interest]) -> dict[str, Any]:
        with self.changed:
            return {key: token for interest in interests for key, token in interest.tokens.items()}

    def register(
        self, interest: Interest, number: int, listener: Callable[[Any, bool], None]
    ) -> None:
        """Call a listener for each token of an interest, and for each change of it."""

        def begin(tokens: list[Any]) -> None:
            interest.listeners[number] = listener
            for token in tokens:
                self._notify(interest, number, token, alive=True)

        def register() -> _Report:
            return partial(begin, list(interest.tokens.values()))

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

    def _acquire(self, key: str, name: str, many: bool) -> Interest:
        with self.changed:
            interest = self._interests.get(key)
            if interest is not None:
                interest.users += 1
                return interest
            interest = self._interests[key] = Interest(key, name)
            interest.users = 1
            whole = self._whole
            interest.is_part = bool(name and whole) and all(other.settled for other in whole)
        if interest.is_part:
            self._events.put(partial(self._begin_part, interest))
            return interest
        try:
            interest.watch = self._session.watch_tokens(
                key,
                lambda token, alive: self._events.put((interest, token, alive)),
                lambda: self._events.put(partial(self._set_complete, interest)),
                many=many,
            )
        except BaseException:
            self.release([interest])
            raise
        if self._lifecycle.closing:  # perhaps too late for the thread that closes the graph
            interest.watch.close()
        return interest

    def _begin_part(self, interest: Interest) -> None:
        """Give a part its tokens of the whole domain."""
        with self.changed:
            for whole in self._whole:
                for key, token in whole.tokens.items():
                    if _name_of(token) == interest.name and _part_key(token) == interest.key:
                        interest.tokens[key] = token
            interest.version += 1
        self._set_complete(interest)

    def check_again(self) -> None:
        """Let all who wait check their conditions."""
        self._events.put(self._note_change)

    def _note_change(self) -> None:
        with self.changed:
            self._version += 1
            self.changed.notify_all()

    def _set_complete(self, interest: Interest) -> None:
        interest.complete = True
        self._note_change()

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
        tokens = interest.tokens
        if alive == (key in tokens):
            return None
        token = self._parse(key) if alive else tokens[key]
        if token is None or interest.name not in {"", _name_of(token)}:
            return None
        with self.changed:
            if alive:
                tokens[key] = token
            else:
                del tokens[key]
            interest.version += 1
            self._version += 1
            self.changed.notify_all()
        report = partial(self._notify_all, interest, token, alive)
        part = self._interests.get(_part_key(token)) if interest in self._whole else None
        if part is None or not part.is_part:
            return report
        reports = [report, self._apply(part, key, alive)]
        return lambda: [action() for action in reports if action is not None]

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

    def _notify_all(self, interest: Interest, token: Token | ProcessToken, alive: bool) -> None:
        for number in list(interest.listeners):
            self._notify(interest, number, token, alive=alive)

    def _notify(
        self, interest: Interest, number: int, token: Token | ProcessToken, *, alive: bool
    ) -> None:
        listener = interest.listeners.get(number)
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


def _name_of(token: Token | ProcessToken) -> str:
    """Return the name by which a token is followed; empty for the token of a node."""
    return token.node if isinstance(token, ProcessToken) else token.name


def _part_key(token: Token | ProcessToken) -> str:
    """Return the key expression by which those follow a token who follow its name alone."""
    if isinstance(token, ProcessToken):
        return processes_key(token.domain, token.node)
    return entities_key(token.domain, token.kind, token.name)
