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

import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TypeVar

from rosz.errors import NotFoundError, WaitTimeout, near_miss
from rosz.graph.followed import Followed, GraphListener
from rosz.graph.interests import COMPLETE_BY, Interests
from rosz.graph.view import View
from rosz.session import Session
from rosz.wire import Kind, entities_key, node_key, processes_key, tokens_key

T = TypeVar("T")
_HINT_TIMEOUT = 1.0


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
        self._interests = Interests(session)
        self._whole: Followed | None = None

    def follow(self, *keys: str) -> Followed:
        """Follow the tokens that match some key expressions, such as `rosz.wire.nodes_key`.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return Followed(self._interests, ((key, "") for key in keys))

    def follow_entities(self, kind: Kind, *names: str) -> Followed:
        """Follow one kind of entity of some topics or services.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        keys = ((entities_key(self.domain, kind, name), name) for name in names)
        return Followed(self._interests, keys)

    def follow_processes(self, node: str) -> Followed:
        """Follow the processes of rosz nodes of a full name.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return Followed(self._interests, [(processes_key(self.domain, node), node)])

    def follow_all(self) -> Followed:
        """Follow the whole domain, which costs each node as much as there are entities in all.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        return Followed(self._interests, ((key, "") for key in self._all_keys()), many=True)

    def view(self) -> View:
        """Return all that is known at this moment, and follow the whole domain from now on.

        The first call waits, at most 2 seconds, until everything is known that exists.

        Raises:
            ClosedError: The graph was closed before the first call.
        """
        if self._whole is None:
            self._whole = self.follow_all()  # of two threads, both may: that costs no other watch
            self._whole.share()
        followed = self._whole
        if not followed.complete:
            deadline = time.monotonic() + COMPLETE_BY
            self._interests.wait_until(lambda: followed.complete, deadline)
        return followed.view()

    def known(self) -> View:
        """Return all followed tokens, also after the graph was closed."""
        return self._interests.known()

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
        return self._interests.query(self._interests.all(), self._all_keys(), timeout)

    def find(self, look: Callable[[View], T]) -> T:
        """Return the result of a search in the graph, for callers that need a name just once.

        It looks at the replies to a query first. On a busy machine these may end before all have
        replied; then it looks at all that exists.

        Args:
            look: Function that raises `NotFoundError` if it does not find what it looks for.

        Raises:
            NotFoundError: It is not there.
            ClosedError: The session is closed.
        """
        with suppress(NotFoundError):
            return look(self.refresh())
        return look(self.view())

    def listen(self, listener: GraphListener) -> Callable[[], None]:
        """Call a function for every change in the whole domain; see `Followed.listen`.

        Raises:
            ClosedError: The graph or its session is closed.
        """
        followed = self.follow(tokens_key(self.domain))
        unregister = followed.listen(listener)

        def stop() -> None:
            unregister()
            followed.close()

        return stop

    def check_again(self) -> None:
        """Let all who wait check their conditions, since these depend on more than the graph."""
        self._interests.check_again()

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
        followed = self.follow(node_key(self.domain, name))
        return self._wait_for_name(followed, View.nodes, name, timeout, f"node '{name}'")

    def wait_for_topic(self, name: str, timeout: float) -> View:
        """Wait for a publisher of a topic; the errors are those of `wait_for`."""
        followed = self.follow_entities(Kind.PUBLISHER, name)
        return self._wait_for_name(followed, View.topics, name, timeout, f"publisher of '{name}'")

    def wait_for_service(self, name: str, timeout: float) -> View:
        """Wait for a server of a service; the errors are those of `wait_for`."""
        followed = self.follow_entities(Kind.SERVICE, name)
        return self._wait_for_name(followed, View.services, name, timeout, f"service '{name}'")

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
        names: Callable[[View], Iterable[str]],
        name: str,
        timeout: float,
        what: str,
    ) -> View:
        try:
            with followed:
                return followed.wait_for(lambda view: name in names(view), timeout, what)
        except WaitTimeout as error:
            present = names(self.refresh(_HINT_TIMEOUT))
            raise WaitTimeout(what, timeout, near_miss(name, present).removeprefix("; ")) from error

    def close(self) -> None:
        """Stop following, and wake waiters with `ClosedError`; a second call has no effect."""
        self._interests.close()

    def _all_keys(self) -> tuple[str, str]:
        return tokens_key(self.domain), processes_key(self.domain)
