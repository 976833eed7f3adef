"""Samples for one subscription alone: each has a key that a publisher can send to."""

from __future__ import annotations

import threading
from collections.abc import Callable

from rosz.lifecycle import Closable, Registration
from rosz.session import Sample, Session
from rosz.wire import Token, is_rosz_id, own_key

_SPACE = "inbox"
_LARGE = "large"


def direct_key(subscription: Token) -> str | None:
    """Return the key that only one subscription receives; ``None`` if its session is not rosz's."""
    return own_direct_key(subscription) if is_rosz_id(subscription.zid) else None


def own_direct_key(subscription: Token) -> str:
    """Return the key that only one subscription of rosz receives."""
    return own_key(subscription.domain, _SPACE, subscription.zid, str(subscription.entity_id))


def announcement_key(direct: str) -> str:
    """Return the key for announcements of large samples to a subscription.

    Args:
        direct: The key that only this subscription receives.
    """
    return f"{direct}/{_LARGE}"


class DirectDelivery:
    """Receives the samples that are sent to single subscriptions of a session.

    Zenoh's subscribers are declared when the first subscription registers.

    Args:
        session: The session.
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self._session = session
        self._key = own_key(domain, _SPACE, session.zid)
        self._lock = threading.RLock()  # a signal handler may subscribe in between
        self._subscribers: list[Closable] = []
        self._receivers: dict[str, Callable[[Sample], None]] = {}

    def register(
        self, entity_id: int, receive: Callable[[Sample], None], announced: Callable[[Sample], None]
    ) -> Registration:
        """Pass on the samples that are sent to one subscription.

        Args:
            entity_id: Number of the subscription.
            receive: Function that gets each sample, on a thread of the session.
            announced: Function that gets each announcement of large samples, likewise.

        Raises:
            ClosedError: The session is closed.
        """
        direct = f"{self._key}/{entity_id}"
        receivers = {direct: receive, announcement_key(direct): announced}
        self._receivers.update(receivers)
        with self._lock:
            if not self._subscribers:
                # Two, because access rules restrict samples more than announcements.
                self._subscribers = [
                    self._session.subscriber(key, self._dispatch, rare=True)
                    for key in (f"{self._key}/*", announcement_key(f"{self._key}/*"))
                ]

        def unregister() -> None:
            for key in receivers:
                self._receivers.pop(key, None)

        return Registration(unregister)

    def _dispatch(self, sample: Sample) -> None:
        receive = self._receivers.get(sample.key)
        if receive is not None:
            receive(sample)
