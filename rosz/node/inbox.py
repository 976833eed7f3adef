"""An address for each subscription, so that a publisher can send something to it alone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from rosz.lifecycle import Closable
from rosz.session import Sample, Session
from rosz.wire import Token, own_key

if TYPE_CHECKING:
    from rosz.graph import View

__all__ = ("Inbox", "address")

_SPACE = "inbox"


def address(subscription: Token, view: View) -> str | None:
    """Return the key that only one subscription hears; ``None`` if it is not one of rosz."""
    if not view.is_rosz(subscription.zid):
        return None
    return own_key(subscription.domain, _SPACE, subscription.zid, str(subscription.entity_id))


class Inbox:
    """What comes for single subscriptions of a session; declared when the first one asks.

    Args:
        session: It.
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self._session = session
        self._key = own_key(domain, _SPACE, session.zid)
        self._lock = threading.RLock()  # a signal handler may subscribe in between
        self._declared: Closable | None = None
        self._owners: dict[str, Callable[[Sample], None]] = {}

    def open(self, entity_id: int, deliver: Callable[[Sample], None]) -> Callable[[], object]:
        """Take in what is addressed to one subscription.

        Args:
            entity_id: Number of the subscription.
            deliver: Gets each sample, on a Zenoh thread.

        Returns:
            A function that ends it.

        Raises:
            ClosedError: The session is closed.
        """
        owner = str(entity_id)
        self._owners[owner] = deliver
        with self._lock:
            if self._declared is None:
                self._declared = self._session.subscriber(f"{self._key}/*", self._sort)
        return lambda: self._owners.pop(owner, None)

    def _sort(self, sample: Sample) -> None:
        deliver = self._owners.get(sample.key.rpartition("/")[2])
        if deliver is not None:
            deliver(sample)
