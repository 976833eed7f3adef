"""Reading and writing on behalf of those who are no replicas: commands, mostly."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from rosz.errors import DecodeError, ParamNotFound, RoszError
from rosz.params.keys import Keys, check_reach
from rosz.params.merge import Change
from rosz.params.paths import Path, split
from rosz.params.replica.reading import names_beside
from rosz.params.replica.worker import Worker
from rosz.params.wire import Answer, Question, decode, encode, packed
from rosz.session import Query, Stamp

if TYPE_CHECKING:
    from rosz.params.replica.replica import Replica

__all__ = ("Server",)

_log = logging.getLogger("rosz.params")

_LONGEST: Final = 60.0
"""Seconds that a write for somebody else may wait at most."""

_AT_ONCE: Final = 16
"""Writes for others that may wait for acknowledgements at a time; further ones are put off."""


class Server:
    """Answers questions, each on the replica's worker, or if it has to wait on its own thread.

    Args:
        replica: Whom to read and write.
        keys: Where it is asked.
        stamp: Gives stamps to those who are to write.
        worker: Where the reading is done.
        ready: Tells whether the replica has joined.
    """

    def __init__(
        self,
        replica: Replica,
        keys: Keys,
        stamp: Callable[[], Stamp],
        worker: Worker,
        ready: Callable[[], bool],
    ) -> None:
        self._replica = replica
        self._keys = keys
        self._stamp_now = stamp
        self._worker = worker
        self._ready = ready
        self._places = threading.BoundedSemaphore(_AT_ONCE)
        self._verbs: dict[str, Callable[[Question], Answer]] = {
            "get": self._get,
            "names": self._names,
            "search": self._search,
            "stamp": self._stamp,
        }

    def serve(self, query: Query) -> None:
        """Take in a question."""
        payload = query.payload or b""
        if not self._worker.offer(lambda: self._read(query, payload)):
            self._reply(query, Answer("joining"))

    def serve_writes(self, query: Query) -> None:
        """Take in a write."""
        payload = query.payload or b""
        if not self._worker.offer(lambda: self._begin_write(query, payload)):
            self._reply(query, Answer("joining"))

    def _read(self, query: Query, payload: bytes) -> None:
        try:
            question = decode(payload, Question)
        except DecodeError as error:
            self._reply(query, Answer("refused", text=str(error)))
            return
        verb = self._verbs.get(question.verb)
        if verb is None:
            self._reply(query, Answer("refused", text=f"'{question.verb}' is nothing to ask for"))
        elif self._ready():
            self._reply(query, self._outcome(lambda: verb(question), question))
        else:
            self._reply(query, Answer("joining"))

    def _begin_write(self, query: Query, payload: bytes) -> None:
        try:
            order = decode(payload, Question)
            reach = self._keys.reach(query.key, self._keys.set(self._replica.zid))
        except DecodeError as error:
            self._reply(query, Answer("refused", text=str(error)))
            return
        if not self._ready() or not self._places.acquire(blocking=False):
            self._reply(query, Answer("joining"))
            return
        threading.Thread(
            target=self._end_write, args=(query, order, reach), name="rosz-params-ask", daemon=True
        ).start()

    def _end_write(self, query: Query, order: Question, reach: Path) -> None:
        try:
            self._reply(query, self._outcome(lambda: self._write(order, reach), order))
        finally:
            self._places.release()

    def _outcome(self, act: Callable[[], Answer], question: Question) -> Answer:
        try:
            return act()
        except ParamNotFound as error:
            beside = names_beside(self._replica.root, split(question.name))
            return Answer("missing", text=str(error), value=beside)
        except RoszError as error:
            return Answer("refused", text=str(error))

    def _reply(self, query: Query, answer: Answer) -> None:
        with query:
            try:
                query.reply(query.key, encode(answer))
            except RoszError as error:
                _log.debug("an answer came too late: %s", error)

    def _get(self, question: Question) -> Answer:
        value = packed(self._replica.peek(question.name))
        return Answer(value=value, origin=self._replica.origin(question.name))

    def _names(self, _: Question) -> Answer:
        return Answer(value=self._replica.names())

    def _search(self, question: Question) -> Answer:
        found = self._replica.search(question.name, question.node)
        return Answer("missing" if found is None else "ok", value=found)

    def _stamp(self, _: Question) -> Answer:
        return Answer(value=self._stamp_now().time)

    def _write(self, order: Question, reach: Path) -> Answer:
        batch = order.batch
        if batch is None:
            return Answer("refused", text="a write that writes nothing")
        changes: list[Change] = [(write.path, write.value) for write in batch.writes()]
        check_reach((path for path, _ in changes), reach)
        stamp = Stamp(batch.time, batch.clock)
        outcome = self._replica.write(
            changes, origin=batch.origin, stamp=stamp, timeout=min(order.timeout, _LONGEST)
        )
        return Answer(slow=list(outcome.slow))
