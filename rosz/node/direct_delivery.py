"""Samples for one subscription alone: each has a key that a publisher can send to."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from rosz.lifecycle import Closable, Registration
from rosz.session import Sample, Session
from rosz.wire import Token, own_key

if TYPE_CHECKING:
    from rosz.graph import View

__all__ = ("DirectDelivery", "direct_key")

_SPACE = "inbox"


def direct_key(subscription: Token, view: View) -> str | None:
    """Return the key that only one subscription receives; ``None`` if its process is not rosz."""
    if not view.is_rosz(subscription.zid):
        return None
    return own_key(subscription.domain, _SPACE, subscription.zid, str(subscription.entity_id))


class DirectDelivery:
    """Receive what is sent to single subscriptions of a session.

    The Zenoh subscriber is declared when the first subscription registers.

    Args:
        session: The session.
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self._session = session
        self._key = own_key(domain, _SPACE, session.zid)
        self._lock = threading.RLock()  # a signal handler may subscribe in between
        self._subscriber: Closable | None = None
        self._receivers: dict[str, Callable[[Sample], None]] = {}

    def register(self, entity_id: int, receive: Callable[[Sample], None]) -> Registration:
        """Pass on what is sent to one subscription.

        Args:
            entity_id: Number of the subscription.
            receive: Function that gets each sample, on a thread of the session.

        Raises:
            ClosedError: The session is closed.
        """
        number = str(entity_id)
        self._receivers[number] = receive
        with self._lock:
            if self._subscriber is None:
                self._subscriber = self._session.subscriber(f"{self._key}/*", self._dispatch)
        return Registration(lambda: self._receivers.pop(number, None))

    def _dispatch(self, sample: Sample) -> None:
        receive = self._receivers.get(sample.key.rpartition("/")[2])
        if receive is not None:
            receive(sample)
