"""What all subscriptions share: a queue, and a callback or somebody who takes from it.

With a callback the queue is Zenoh's own, which Python takes part in only when a sample's turn
comes: from arrival to callback takes half the time of a queue in Python. What does not come through
it, such as the history of latching publishers, has a queue and a thread here; callbacks take turns.
"""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator, Callable, Iterator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosz.errors import ClosedError
from rosz.node.feed import Feed, Take
from rosz.session.starting import start

if TYPE_CHECKING:
    from rosz.lifecycle import Closable
    from rosz.node.node import Node
    from rosz.qos import QoS
    from rosz.session import PullSubscriber, Reply, Sample

__all__ = ("Reader",)

M = TypeVar("M")

_ALL = 1 << 17
"""Samples that are kept when all are to be kept: a callback that hangs must not eat the memory."""

_MOST = 1 << 20
"""Samples that a queue holds at most: Zenoh sets aside 256 bytes for each at once, and ends the
process where that much is not to be had."""


class Reader(Generic[M]):
    """The taking end of a subscription.

    With a callback, a thread of its own dispatches. Without one, whoever iterates or calls `get`
    does. Samples are decoded when their turn comes, so those that newer ones push out cost nothing.

    Args:
        node: The node that it belongs to.
        name: Resolved name of the topic.
        callback: Gets each message, and its info if ``with_info``.
        qos: Says how many samples wait at most.
        with_info: Whether the callback takes a `MessageInfo`, too.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        callback: Callable[..., Any] | None,
        qos: QoS,
        *,
        with_info: bool,
    ) -> None:
        self._owner = node
        self._topic = name
        self._callback = callback
        self._with_info = with_info
        self._depth = _ALL if qos.history == "keep_all" else min(qos.depth, _MOST)
        self._feed = Feed(name, self._depth)
        self._turn = threading.Lock()
        self._thread: threading.Thread | None = None
        self._starting = threading.Lock()

    def _subscribe(
        self, key: str, take: Take, *, history: int = 0, recover: bool = False
    ) -> Closable:
        """Declare the subscriber, and begin to dispatch if there is a callback."""
        session = self._owner.context.session
        if self._callback is None:
            return session.subscriber(
                key, lambda sample: self._put(take, sample), history=history, recover=recover
            )
        ring = session.pull_subscriber(key, self._depth, history=history, recover=recover)
        threading.Thread(
            target=self._run, args=(ring, take), name=f"rosz-sub{self._topic}", daemon=True
        ).start()
        return ring

    def _put(self, take: Take, sample: Sample | Reply) -> None:
        """Take a sample in that does not come through Zenoh's own queue; called on its threads."""
        self._feed.put(take, sample)
        if self._callback is not None and self._thread is None:
            with self._starting:
                if self._thread is None:
                    self._thread = threading.Thread(
                        target=self._feed.run,
                        args=(self._handle,),
                        name=f"rosz-sub{self._topic}",
                        daemon=True,
                    )
                    start(self._thread)

    def _run(self, ring: PullSubscriber, take: Take) -> None:
        while not self._feed.closed:
            try:
                sample = ring.receive()
            except ClosedError:
                return
            self._handle(take, sample)

    def _handle(self, take: Take, sample: Sample | Reply) -> None:
        callback = self._callback
        if callback is None or self._feed.closed:
            return
        try:
            with self._turn:
                taken = take(sample)
                if taken is None:
                    return
                if self._with_info:
                    callback(*taken)
                else:
                    callback(taken[0])
        except BaseException as error:  # noqa: BLE001  # the thread outlives what a callback raises
            ending = self._feed.closed or self._owner.context.is_shutdown
            # What a callback tries while its node is being shut down is no fault of its.
            if not (ending and isinstance(error, ClosedError)):
                self._owner.log.report(f"callback of '{self._topic}' failed", error)

    def get(self, timeout: float = 10.0) -> M:
        """Return the oldest message of the queue, waiting for one.

        Args:
            timeout: Seconds.

        Raises:
            WaitTimeout: None came in time.
            ClosedError: The subscription was closed meanwhile.
            UsageError: The timeout is no number.
        """
        message: M = self._feed.get(timeout)
        return message

    def __iter__(self) -> Iterator[M]:
        """Yield messages until the subscription or its context is closed."""
        self._owner.context.cooperative = True
        return iter(self._feed)

    def __aiter__(self) -> AsyncIterator[M]:
        """Yield messages in an asyncio program until the subscription or its context is closed."""
        self._owner.context.cooperative = True
        return aiter(self._feed)
