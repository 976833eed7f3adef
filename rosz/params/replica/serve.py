"""The services of a replica for programs that do not have one.

`ClientServer` reads and writes for `rosz.params.replica.ParamClient`, mostly commands.

`ParameterKeys` keeps one key for each parameter, for any Zenoh program and Zenoh's own storages.
Every parameter that is not a dict has a key. Whoever sets the parameter writes the key while
anybody subscribes to it, and each replica answers queries on the keys. So a storage on the keys
holds the whole store, and the first replica that starts asks whether there is one. A storage may
hold wrong values if writers did not know of each other, and old ones if it was away, so the oldest
replica compares it with the tree from time to time.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import Any, Final

from rosz.errors import DecodeError, ParamError, ParamNotFound, PartlyWritten, RoszError
from rosz.lifecycle import Closable
from rosz.params.paths import Path, split
from rosz.params.replica.core.effects import TreeChanged
from rosz.params.replica.reader import TreeReader, names_beside
from rosz.params.replica.runner import CoreRunner, beat_until
from rosz.params.tree import MISSING, lookup
from rosz.params.values import Value
from rosz.params.wire import (
    Batch,
    ClientReply,
    ClientRequest,
    Keys,
    check_reach,
    decode,
    decode_value,
    encode,
    encode_value,
    pack_value,
)
from rosz.params.writes import Change, Write, put
from rosz.session import Query, Reply, Session, Stamp, is_key_in
from rosz.worker import lend_thread

_log = logging.getLogger("rosz.params")

_MAX_TIMEOUT: Final = 600.0
"""Longest time in seconds that a write for a client waits for the other replicas."""

_MAX_WRITES: Final = 16
"""Writes for clients that wait for acknowledgements at a time; further clients try again."""

_MAX_ID: Final = 32
"""Digits of a clock in a Zenoh timestamp; `History.provable` makes one with a digit more."""

_STORAGE_TIMEOUT: Final = 1.0
_STORAGES_ONLY: Final = "_by=replica"
"""Parameter of a query that storages answer and replicas do not."""


class ClientServer:
    """Reads on the replica's worker, and writes on a thread that is lent for each, for clients.

    Args:
        session: Session of the replica.
        keys: Keys of the domain.
        runner: The replica's core.
        write: `Replica.write`.
    """

    def __init__(
        self, session: Session, keys: Keys, runner: CoreRunner, write: Callable[..., Any]
    ) -> None:
        self._state = runner
        self._reader = TreeReader(runner)
        self._write_batch = write
        self._worker = runner.worker
        self._slots = threading.BoundedSemaphore(_MAX_WRITES)
        self._keys = keys
        self._set_key = keys.of(session.zid, "set")
        ask_key = keys.of(session.zid, "ask")
        on_read = partial(self._on_query, self._reply_to_read)
        on_write = partial(self._on_query, self._start_write)
        self._declared = [
            session.queryable(ask_key, on_read, complete=True),
            session.queryable(f"{self._set_key}/**", on_write, complete=True),
        ]

    def close(self) -> None:
        """Stop serving; a second call has no effect."""
        for declared in self._declared:
            declared.close()

    def _on_query(self, handle: Callable[[Query, ClientRequest], None], query: Query) -> None:
        payload = query.payload or b""
        if not self._worker.offer(lambda: self._handle(handle, query, payload)):
            _reply(query, ClientReply("joining"))

    def _handle(
        self, handle: Callable[[Query, ClientRequest], None], query: Query, payload: bytes
    ) -> None:
        try:
            request = decode(payload, ClientRequest)
            if self._state.core.ready:
                handle(query, request)
            else:
                _reply(query, ClientReply("joining"))
        except DecodeError as error:
            _reply(query, ClientReply("refused", text=str(error)))

    def _reply_to_read(self, query: Query, request: ClientRequest) -> None:
        _reply(query, self._try(self._read, request))

    def _start_write(self, query: Query, request: ClientRequest) -> None:
        if request.verb == "stamp":  # which a client without permission to read asks for here
            self._reply_to_read(query, request)
            return
        reach = self._keys.reach(query.key, self._set_key)
        if not self._slots.acquire(blocking=False):
            _reply(query, ClientReply("joining"))
            return
        if not lend_thread(partial(self._finish_write, query, request, reach)):
            self._slots.release()
            _reply(query, ClientReply("joining"))

    def _finish_write(self, query: Query, request: ClientRequest, reach: Path) -> None:
        ended = threading.Event()
        if request.beats:
            beat_until(ended, partial(self._report_progress, query, request.batch))
        try:
            reply = self._try(partial(self._write, reach), request)
        finally:
            ended.set()
            self._slots.release()
        _reply(query, reply)

    def _report_progress(self, query: Query, batch: Batch | None) -> None:
        if batch is not None:
            holders, waiting = self._state.core.progress((batch.time, batch.clock))
            reply = ClientReply("working", holders=holders, slow=waiting)
            with suppress(RoszError):  # the last reply has closed the query meanwhile
                query.reply(query.key, encode(reply))

    def _try(
        self, verb: Callable[[ClientRequest], ClientReply], request: ClientRequest
    ) -> ClientReply:
        try:
            return verb(request)
        except PartlyWritten as error:
            reply = ClientReply("refused", text=str(error), slow=list(error.slow))
            reply.holders, reply.reasons, reply.what = error.holders, error.reasons, error.what
            return reply
        except ParamNotFound as error:
            beside = names_beside(self._state.root, split(request.name))
            return ClientReply("missing", text=str(error), value=beside)
        except RoszError as error:
            return ClientReply("refused", text=str(error))

    def _read(self, request: ClientRequest) -> ClientReply:
        match request.verb:
            case "get":
                path = split(request.name)
                value = pack_value(self._reader.peek(path))
                return ClientReply(value=value, origin=self._reader.origin(path))
            case "names":
                return ClientReply(value=self._reader.names())
            case "search":
                name = self._reader.search(request.name, request.node)
                return ClientReply("missing" if name is None else "ok", value=name)
            case "stamp":
                return ClientReply(value=self._state.stamp().time)
        raise ParamError(f"'{request.verb}' is not a known verb")

    def _write(self, reach: Path, request: ClientRequest) -> ClientReply:
        batch = request.batch
        if batch is None:
            raise ParamError("a write without a batch")
        changes: list[Change] = [(write.path, write.value) for write in batch.writes()]
        check_reach((path for path, _ in changes), reach)
        stamp = Stamp(batch.time, batch.clock)
        timeout = min(request.timeout, _MAX_TIMEOUT)
        how: Any = {"origin": batch.origin, "stamp": stamp, "by_progress": request.beats}
        outcome = self._write_batch(changes, timeout=timeout, **how)
        return ClientReply(slow=list(outcome.slow), holders=outcome.holders)


def _reply(query: Query, reply: ClientReply) -> None:
    with query:
        try:
            query.reply(query.key, encode(reply))
        except RoszError as error:
            _log.debug("a reply came too late: %s", error)


class ParameterKeys:
    """Writes one key for each parameter, and answers queries on the keys.

    Args:
        session: Session of the replica.
        keys: Keys of the domain.
        runner: The replica's core.
    """

    def __init__(self, session: Session, keys: Keys, runner: CoreRunner) -> None:
        self._session = session
        self._keys = keys
        self._state = runner
        self._worker = runner.worker
        self._publisher = session.publisher(keys.all_params)
        self._queryable: Closable | None = None
        self._lock = threading.Lock()
        self._closed = False

    @property
    def subscribed(self) -> bool:
        """Whether anybody subscribes to single parameters."""
        return self._publisher.matched

    def serve(self, is_wanted: Callable[[], bool]) -> None:
        """Reply to queries on the keys from now on, or stop.

        One replica replies for all. If each did, all would declare one key expression with
        wildcards, and Zenoh keeps memory for each session that declared one which others keep
        (`tests/upstream/memory.py`).

        Args:
            is_wanted: Function that tells whether this replica is the one, now.
        """
        with self._lock:
            wanted = is_wanted() and not self._closed
            if wanted and self._queryable is None:
                self._queryable = self._session.queryable(
                    self._keys.all_params, self._on_query, complete=True
                )
            elif not wanted and self._queryable is not None:
                self._queryable.close()
                self._queryable = None

    def publish(self, change: TreeChanged) -> None:
        """Write the keys that a change concerns, in the background."""
        if self.subscribed:
            self._worker.submit(lambda: self._publish(change))

    def load(self) -> list[Write]:
        """Return the content of storages as writes."""
        writes = []
        for reply in self._query_storages():
            try:
                writes.append(self._read(reply))
            except DecodeError as error:
                _log.warning("a storage holds something that is not a parameter: %s", error)
        return writes

    def reconcile(self) -> None:
        """Make storages hold the values of the tree, and nothing else."""
        missing = dict(_keyed(self._state.root, ()))
        for reply in self._query_storages():
            try:
                path = self._keys.path(reply.key)
                value = decode_value(reply.payload)
            except DecodeError:
                self._session.delete(reply.key, stamp=self._state.stamp())
                continue
            if path not in missing:
                self._session.delete(reply.key, stamp=self._state.stamp())
            elif encode_value(missing[path]) == encode_value(value):
                del missing[path]
        for path, value in missing.items():
            self._put(path, value, self._state.stamp())

    def close(self) -> None:
        """Undeclare the keys; a second call has no effect."""
        self._publisher.close()
        self._closed = True
        self.serve(lambda: False)

    def _query_storages(self) -> list[Reply]:
        try:
            replies = self._session.get(
                self._keys.all_params, parameters=_STORAGES_ONLY, timeout=_STORAGE_TIMEOUT
            )
        except RoszError as error:
            _log.warning("cannot ask for storages of parameters: %s", error)
            return []
        return [reply for reply in replies if reply.ok and not reply.deleted]

    def _read(self, reply: Reply) -> Write:
        path = self._keys.path(reply.key)
        stamp = reply.stamp
        if stamp is None:
            raise DecodeError("parameter", -1, f"'{reply.key}' has no timestamp")
        return put(path, (stamp.time, stamp.id), decode_value(reply.payload), "a storage")

    def _publish(self, change: TreeChanged) -> None:
        for write in change.writes:
            before, after = lookup(change.old, write.path), lookup(change.new, write.path)
            kept = dict(_keyed(after, write.path)) if after is not MISSING else {}
            gone = dict(_keyed(before, write.path)) if before is not MISSING else {}
            stamp = Stamp(write.time, write.clock)
            for path in (gone.keys() - kept.keys()).union(_leaves_above(change.old, write.path)):
                self._session.delete(self._keys.param(path), stamp=stamp)
            for path, value in kept.items():
                self._put(path, value, stamp)

    def _put(self, path: Path, value: Value, stamp: Stamp) -> None:
        self._session.put(self._keys.param(path), encode_value(value), stamp=stamp)

    def _on_query(self, query: Query) -> None:
        if _STORAGES_ONLY in query.parameters:
            query.close()
            return
        if not self._worker.offer(lambda: self._answer(query)):
            with query:
                query.reply_error("this replica has too many queries; ask again later")

    def _answer(self, query: Query) -> None:
        with query:
            try:
                selected = list(self._select(query.key))
            except DecodeError as error:
                query.reply_error(str(error))
                return
            for path, value in selected:
                with self._state as history:
                    source = history.source(path)
                stamp = None if source is None else Stamp(source.time, source.clock[:_MAX_ID])
                query.reply(self._keys.param(path), encode_value(value), stamp=stamp)

    def _select(self, key: str) -> Iterator[tuple[Path, Value]]:
        root = self._state.root
        if "*" not in key:
            path = self._keys.path(key)
            value = lookup(root, path)
            if value is not MISSING:
                yield path, value
            return
        for path, value in _keyed(root, ()):
            if is_key_in(key, self._keys.param(path)):
                yield path, value


def _keyed(value: Value, path: Path) -> Iterator[tuple[Path, Value]]:
    """Yield the path and value of everything with a key of its own: leaves and empty dicts.

    A dict has a key of its own as well if a name in it is empty or holds a slash, because the keys
    of its items would mean other parameters.
    """
    are_parts = type(value) is dict and all(name and "/" not in name for name in value)
    if not are_parts or (not value and path):
        yield path, value
        return
    for key, item in value.items():
        yield from _keyed(item, (*path, key))


def _leaves_above(root: Value, path: Path) -> Iterator[Path]:
    """Yield the path of the leaf above a path, if there is one."""
    for depth in range(1, len(path)):
        value = lookup(root, path[:depth])
        if value is not MISSING and type(value) is not dict:
            yield path[:depth]
