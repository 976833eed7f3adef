"""The store for those who are no replicas: any Zenoh client, and Zenoh's own storages.

Every parameter that is no dict stands under its own key, written by whoever set it as soon as
anybody subscribes, and each replica answers queries on those keys. So a storage on them holds the
whole store, and the first replica that starts asks whether there is one.

What a storage holds may be wrong where writers did not know of each other, or out of date because
it was away. So the oldest replica compares it with the tree from time to time.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Final

from rosz.errors import DecodeError, RoszError
from rosz.params.keys import Keys, matches
from rosz.params.paths import Path
from rosz.params.replica.state import State, Step
from rosz.params.replica.worker import Worker
from rosz.params.tree import MISSING, lookup
from rosz.params.values import Value
from rosz.params.wire import decode_value, encode_value
from rosz.params.writes import Write, put
from rosz.session import Query, Reply, Session, Stamp

__all__ = ("Mirror",)

_log = logging.getLogger("rosz.params")

_TIMEOUT: Final = 1.0
_ONLY_OTHERS: Final = "_by=replica"
"""Parameter of a query that replicas leave to storages."""


class Mirror:
    """The keys of single parameters, written and answered.

    Args:
        session: The network.
        keys: Where.
        state: What.
        worker: Where whatever takes time is done.
    """

    def __init__(self, session: Session, keys: Keys, state: State, worker: Worker) -> None:
        self._session = session
        self._keys = keys
        self._state = state
        self._worker = worker
        self._publisher = session.publisher(keys.below)
        self._queryable = session.queryable(keys.below, self._on_query, complete=True)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to single parameters."""
        return self._publisher.matched

    def show(self, step: Step) -> None:
        """Write what changed to the keys, in the background."""
        if self.wanted:
            self._worker.submit(lambda: self._show(step))

    def restore(self) -> list[Write]:
        """Return what storages hold, as writes."""
        found = []
        for reply in self._ask():
            try:
                found.append(self._write(reply))
            except DecodeError as error:
                _log.warning("a storage holds what is no parameter: %s", error)
        return found

    def reconcile(self) -> None:
        """Make storages hold what the tree holds, and nothing else."""
        tree = dict(_shown(self._state.root, ()))
        for reply in self._ask():
            try:
                path = self._keys.path(reply.key)
                value = decode_value(reply.payload)
            except DecodeError:
                self._session.delete(reply.key, stamp=self._state.stamp())
                continue
            if path not in tree:
                self._session.delete(reply.key, stamp=self._state.stamp())
            elif encode_value(tree[path]) == encode_value(value):
                del tree[path]
        for path, value in tree.items():
            self._put(path, value, self._state.stamp())

    def close(self) -> None:
        """Undeclare all; again is no error."""
        self._publisher.close()
        self._queryable.close()

    def _ask(self) -> list[Reply]:
        try:
            replies = self._session.get(self._keys.below, parameters=_ONLY_OTHERS, timeout=_TIMEOUT)
        except RoszError as error:
            _log.warning("cannot ask for storages of parameters: %s", error)
            return []
        return [reply for reply in replies if reply.ok and not reply.deleted]

    def _write(self, reply: Reply) -> Write:
        path = self._keys.path(reply.key)
        stamp = reply.stamp
        if stamp is None:
            raise DecodeError("parameter", -1, f"'{reply.key}' has no timestamp")
        value = decode_value(reply.payload)
        return put(path, (stamp.time, stamp.id), value, "a storage")

    def _show(self, step: Step) -> None:
        old, new, news = step
        for write in news:
            before = lookup(old, write.path)
            after = lookup(new, write.path)
            kept = dict(_shown(after, write.path)) if after is not MISSING else {}
            gone = dict(_shown(before, write.path)) if before is not MISSING else {}
            stamp = Stamp(write.time, write.clock)
            for path in gone.keys() - kept.keys():
                self._session.delete(self._keys.param(path), stamp=stamp)
            for path in _leaves_above(old, write.path):
                self._session.delete(self._keys.param(path), stamp=stamp)
            for path, value in kept.items():
                self._put(path, value, stamp)

    def _put(self, path: Path, value: Value, stamp: Stamp) -> None:
        self._session.put(self._keys.param(path), encode_value(value), stamp=stamp)

    def _on_query(self, query: Query) -> None:
        if _ONLY_OTHERS in query.parameters:
            query.close()
            return
        if not self._worker.offer(lambda: self._answer(query)):
            with query:
                query.reply_error("too much is asked of this replica; ask again later")

    def _answer(self, query: Query) -> None:
        with query:
            try:
                selected = list(self._selected(query.key))
            except DecodeError as error:
                query.reply_error(str(error))
                return
            for path, value in selected:
                source = self._state.source(path)
                stamp = None if source is None else Stamp(source.time, source.clock)
                query.reply(self._keys.param(path), encode_value(value), stamp=stamp)

    def _selected(self, key: str) -> Iterator[tuple[Path, Value]]:
        root = self._state.root
        if "*" not in key:
            path = self._keys.path(key)
            value = lookup(root, path)
            if value is not MISSING:
                yield path, value
            return
        for path, value in _shown(root, ()):
            if matches(key, self._keys.param(path)):
                yield path, value


def _shown(value: Value, path: Path) -> Iterator[tuple[Path, Value]]:
    """Yield what has a key of its own: all that is no dict, and dicts that are empty.

    So does a dict whose names no key could tell from others: that of ``b/c`` is one level deeper.
    """
    if type(value) is not dict or (not value and path) or not all(map(_is_part, value)):
        yield path, value
        return
    for key, item in value.items():
        yield from _shown(item, (*path, key))


def _is_part(name: str) -> bool:
    return bool(name) and "/" not in name


def _leaves_above(root: Value, path: Path) -> Iterator[Path]:
    """Yield the leaf that stood in the way of a path, if one did."""
    for depth in range(1, len(path)):
        value = lookup(root, path[:depth])
        if value is not MISSING and type(value) is not dict:
            yield path[:depth]
