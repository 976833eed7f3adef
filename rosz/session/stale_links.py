"""Noticing that the links of this core are of no more use, as after a suspension or a split.

A process is suspended while it is stopped (SIGSTOP, Ctrl-Z) or while its machine sleeps. Others
give up its links then, and routers of eclipse-zenoh 1.10.2 that link to each other again do not
recover from that: when a router accepts a new link of another router before it has forgotten the
last one, it confuses the two. From then on it takes no tokens, subscriptions or queries from there,
for as long as the new link lasts. See `tests/upstream/stopped_router.py`.

So each core tells others on request which sessions it has tokens of. A difference that stays the
same for a while is such a split; the tokens of nodes that start or end change meanwhile.
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

_SPACE = "core"
_PERIOD = 2.0
_TIMEOUT = 3.0
_STABLE_SECONDS = 12.0
_LONGEST_STABLE_SECONDS = 1920.0
_MOST_CORES = 1000
_log = logging.getLogger("rosz.core")

_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The clock that counts the time in which the machine sleeps, where there is one."""


class SuspensionDetector:
    """Tells, from the pauses between its calls, whether this process was suspended.

    Args:
        longest: The pause in seconds that links outlast.
    """

    def __init__(self, longest: float) -> None:
        self._longest = longest
        self._last = time.clock_gettime(_CLOCK)

    def seconds(self) -> float:
        """Return the length of the pause before this call; 0 if links outlast it."""
        now = time.clock_gettime(_CLOCK)
        passed, self._last = now - self._last, now
        return passed if passed > self._longest else 0.0


CoreView = dict[str, int]
"""A checksum of the tokens of each session that a core knows, by the id of the session."""

_ViewDifference = tuple[str, str, int | None, int | None]
"""A core, a session, and the checksums of its tokens here and there."""


class ViewDifferences:
    """The differences between the views of cores, and how long they have been there.

    Args:
        stable: Seconds for which a difference has to stay.
    """

    def __init__(self, stable: float) -> None:
        self._stable = stable
        self._since: dict[_ViewDifference, float] = {}

    def update(
        self, own: CoreView, others: Mapping[str, CoreView | None], now: float
    ) -> tuple[str, str] | None:
        """Compare views.

        Args:
            own: CoreView of this core.
            others: CoreView of each other core by its id; None if it should have replied.
            now: The time in seconds.

        Returns:
            The id of a core and of a session that have differed for long enough; the latter is
            empty if the core does not reply. None if there are none.
        """
        now_different: set[_ViewDifference] = set()
        for core, view in others.items():
            if view is None:
                now_different.add((core, "", None, None))
                continue
            for zid in own.keys() | view.keys():
                if own.get(zid) != view.get(zid):
                    now_different.add((core, zid, own.get(zid), view.get(zid)))
        self._since = {each: self._since.get(each, now) for each in now_different}
        for (core, zid, ours, theirs), since in self._since.items():
            # The core that lacks something comes first, so that usually only one of two acts.
            lacks = theirs is None and ours is not None
            if now - since >= self._stable * (2 if lacks else 1):
                return core, zid
        return None


class SplitWatch:
    """Compares the tokens that this core and all others know, and reports a lasting difference.

    Args:
        session: Session of this core.
        domain: ROS domain.
        tokens: Key expressions of the tokens to compare.
        on_split: Function called once, with the reason.
        times: Number of times that this was the case just before; each doubles the seconds
            for which a difference has to stay.
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
        self._cores: list[str] = []  # that replied; those that did so last are at the end
        self._differences = ViewDifferences(
            min(_STABLE_SECONDS * 2**times, _LONGEST_STABLE_SECONDS)
        )
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

    def _view(self) -> CoreView:
        tokens: dict[str, list[str]] = {}
        for space in self._tokens:
            for key in self._session.live_tokens(space, _TIMEOUT):
                zid = key.split("/")[3 if key.startswith(OWN_SPACE) else 2]
                tokens.setdefault(zid, []).append(key)
        return {zid: crc32("\n".join(keys).encode()) for zid, keys in tokens.items()}

    def _compare(self) -> None:
        replies = self._replies()
        own = self._view()
        self._cores = [*(zid for zid in self._cores if zid not in replies), *replies][-_MOST_CORES:]
        reachable = own.keys() | set(self._session.peers())
        others: dict[str, CoreView | None] = {
            zid: replies.get(zid) for zid in self._cores if zid in reachable
        }
        split = self._differences.update(own, others, time.monotonic())
        if split is None:
            self._worker.later(_PERIOD, self._compare)
        else:
            core, zid = split
            what = f"knows other tokens of session {zid}" if zid else "replies no more"
            self._on_split(f"core {core} {what}, although there is a link to it")

    def _replies(self) -> dict[str, CoreView]:
        views: dict[str, CoreView] = {}
        try:
            for reply in self._session.get(f"{self._space}/*", timeout=_TIMEOUT, priority="urgent"):
                zid = reply.key.rpartition("/")[2]
                if reply.ok and zid != self._session.zid:
                    views[zid] = msgspec.msgpack.decode(reply.payload, type=CoreView)
        except (RoszError, msgspec.DecodeError) as error:
            _log.debug("cannot compare with other cores: %s", error)
        return views
