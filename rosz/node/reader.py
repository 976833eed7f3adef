"""What all subscriptions share: a queue, and a callback or somebody who takes from it."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator, Callable, Iterator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosz.errors import ClosedError
from rosz.node.channel import Taken
from rosz.node.feed import Feed

if TYPE_CHECKING:
    from rosz.node.node import Node
    from rosz.qos import QoS

__all__ = ("Reader",)

M = TypeVar("M")


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
        self._feed = Feed(name, depth_of(qos))

    def _start(self) -> None:
        """Begin to dispatch, if there is a callback."""
        if self._callback is not None:
            threading.Thread(
                target=self._feed.run,
                args=(self._handle,),
                name=f"rosz-sub{self._topic}",
                daemon=True,
            ).start()

    def _handle(self, taken: Taken) -> None:
        if self._callback is None:
            return
        try:
            if self._with_info:
                self._callback(*taken)
            else:
                self._callback(taken[0])
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
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
        """
        message: M = self._feed.get(timeout)
        return message

    def __iter__(self) -> Iterator[M]:
        """Yield messages until the subscription or its context is closed."""
        self._owner.context.cooperative = True
        return iter(self._feed)

    def __aiter__(self) -> AsyncIterator[M]:
        """Yield messages in an asyncio program until the subscription or its context is closed."""
        return aiter(self._feed)


def depth_of(qos: QoS) -> int | None:
    """Return how many samples wait at most; ``None`` for no limit."""
    return None if qos.history == "keep_all" else max(qos.depth, 1)
