"""Counts of the samples that the publishers and subscriptions of a process have dropped."""

from __future__ import annotations

import logging
import threading
from collections import Counter

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.session import Query, Session
from rosz.wire import dropped_key

__all__ = ("DroppedSamples",)

_log = logging.getLogger("rosz.node")


class DroppedSamples:
    """Counts dropped samples, and tells those who query the counts.

    The queryable is declared with the first dropped sample.

    Args:
        session: The session.
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self._session = session
        self._key = dropped_key(domain, session.zid)
        self._counts: Counter[int] = Counter()
        self._lock = threading.RLock()  # a signal handler may publish meanwhile
        self._queryable: Closable | None = None

    def add(self, entity_id: int, count: int) -> None:
        """Count samples that an entity has dropped."""
        with self._lock:
            self._counts[entity_id] += count
            if self._queryable is None:
                try:
                    self._queryable = self._session.queryable(self._key, self._reply)
                except RoszError as error:  # the session closes
                    _log.debug("nobody can query dropped samples: %s", error)

    def _reply(self, query: Query) -> None:
        with query:
            with self._lock:
                counts = dict(self._counts)
            query.reply(self._key, msgspec.msgpack.encode(counts))
