"""Noticing that this core and others do not know the same tokens although they are linked.

Seen with eclipse-zenoh 1.10.2: when a router accepts a new link of another router before it has
forgotten the last one, it confuses the two. From then on it takes no tokens, subscriptions or
queries from there, for as long as the new link lasts. See `tests/upstream/stopped_router.py`.

So each core tells others on request which sessions it has tokens of. A difference that stays the
same for a while is such a confusion; the tokens of nodes that start or end change meanwhile.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from zlib import crc32

import msgspec

from rosz.errors import RoszError
from rosz.session.queries import Query
from rosz.session.session import Session
from rosz.wire import OWN_SPACE, own_key
from rosz.worker import Worker

__all__ = ("Differences", "SplitWatch")

_SPACE = "core"
_PERIOD = 2.0
_TIMEOUT = 3.0
_PATIENCE = 12.0
_MAX_PATIENCE = 1920.0
_log = logging.getLogger("rosz.core")

View = dict[str, int]
"""A checksum of the tokens of each session that a core knows, by the id of the session."""


class Differences:
    """The differences between the views of cores, and how long they have been there.

    Args:
        patience: Seconds for which a difference has to stay.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._since: dict[tuple[str, str, int | None, int | None], float] = {}

    def update(
        self, own: View, others: Mapping[str, View | None], now: float
    ) -> tuple[str, str] | None:
        """Compare views.

        Args:
            own: View of this core.
            others: View of each other core by its id; None if it should have replied.
            now: The time in seconds.

        Returns:
            The id of a core and of a session that have differed for long enough; the latter is
            empty if the core does not reply. None if there are none.
        """
        found: set[tuple[str, str, int | None, int | None]] = set()
        for core, view in others.items():
            if view is None:
                found.add((core, "", None, None))
                continue
            for zid in own.keys() | view.keys():
                if own.get(zid) != view.get(zid):
                    found.add((core, zid, own.get(zid), view.get(zid)))
        self._since = {one: self._since.get(one, now) for one in found}
        for (core, zid, mine, theirs), since in self._since.items():
            # The core that lacks something comes first, so that usually only one of two acts.
            lacks = theirs is None and mine is not None
            if now - since >= self._patience * (2 if lacks else 1):
                return core, zid
        return None


class SplitWatch:
    """Compares what this core and all others know, and calls back when they do not agree.

    Args:
        session: Session of this core.
        domain: ROS domain.
        tokens: Key expressions of the tokens to compare.
        on_split: Function called once, with the reason.
        times: Number of times that this was the case just before; each doubles the patience.
    """

    def __init__(
        self,
        session: Session,
        domain: int,
        tokens: Sequence[str],
        on_split: Callable[[str], object],
        times: int = 0,
    ) -> None:
        self._session = session
        self._tokens = tokens
        self._on_split = on_split
        self._space = own_key(domain, _SPACE)
        self._key = f"{self._space}/{session.zid}"
        self._known: set[str] = set()
        self._differences = Differences(min(_PATIENCE * 2**times, _MAX_PATIENCE))
        self._worker: Worker[Callable[[], object]] = Worker("rosz-split", logger=_log)
        self._queryable = session.queryable(self._key, self._on_query)
        self._worker.later(_PERIOD, self._compare)

    def close(self) -> None:
        """Stop comparing; a second call has no effect."""
        self._queryable.close()
        self._worker.close()

    def _on_query(self, query: Query) -> None:
        with query:
            query.reply(self._key, msgspec.msgpack.encode(self._view()))

    def _view(self) -> View:
        tokens: dict[str, list[str]] = {}
        for space in self._tokens:
            for key in self._session.live_tokens(space, _TIMEOUT):
                zid = key.split("/")[3 if key.startswith(OWN_SPACE) else 2]
                tokens.setdefault(zid, []).append(key)
        return {zid: crc32("\n".join(keys).encode()) for zid, keys in tokens.items()}

    def _compare(self) -> None:
        replies = self._replies()
        own = self._view()
        self._known |= replies.keys()
        reachable = own.keys() | set(self._session.peers())
        others: dict[str, View | None] = {zid: replies.get(zid) for zid in self._known & reachable}
        split = self._differences.update(own, others, time.monotonic())
        if split is None:
            self._worker.later(_PERIOD, self._compare)
        else:
            core, zid = split
            what = f"knows other tokens of session {zid}" if zid else "replies no more"
            self._on_split(f"core {core} {what}, although there is a link to it")

    def _replies(self) -> dict[str, View]:
        found: dict[str, View] = {}
        try:
            for reply in self._session.get(f"{self._space}/*", timeout=_TIMEOUT, priority="urgent"):
                zid = reply.key.rpartition("/")[2]
                if reply.ok and zid != self._session.zid:
                    found[zid] = msgspec.msgpack.decode(reply.payload, type=View)
        except (RoszError, msgspec.DecodeError) as error:
            _log.debug("cannot compare with other cores: %s", error)
        return found
