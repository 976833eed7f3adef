"""Reading and writing on behalf of those who are no replicas: commands, mostly."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from rosz.errors import DecodeError, ParamNotFound, RoszError
from rosz.params.merge import Change
from rosz.params.paths import split
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
        stamp: Gives stamps to those who are to write.
        worker: Where the reading is done.
        ready: Tells whether the replica has joined.
    """

    def __init__(
        self,
        replica: Replica,
        stamp: Callable[[], Stamp],
        worker: Worker,
        ready: Callable[[], bool],
    ) -> None:
        self._replica = replica
        self._stamp_now = stamp
        self._worker = worker
        self._ready = ready
        self._places = threading.BoundedSemaphore(_AT_ONCE)
        self._verbs: dict[str, Callable[[Question], Answer]] = {
            "get": self._get,
            "names": self._names,
            "search": self._search,
            "write": self._write,
            "stamp": self._stamp,
        }

    def serve(self, query: Query) -> None:
        """Take in a question."""
        payload = query.payload or b""
        self._worker.submit(lambda: self._sort(query, payload))

    def _sort(self, query: Query, payload: bytes) -> None:
        try:
            question = decode(payload, Question)
        except DecodeError as error:
            self._reply(query, Answer("refused", text=str(error)))
            return
        verb = self._verbs.get(question.verb)
        if verb is None:
            self._reply(query, Answer("refused", text=f"'{question.verb}' is nothing to ask for"))
        elif not self._ready():
            self._reply(query, Answer("joining"))
        elif question.verb != "write":
            self._reply(query, self._outcome(verb, question))
        elif self._places.acquire(blocking=False):
            threading.Thread(
                target=self._wait, args=(query, verb, question), name="rosz-params-ask", daemon=True
            ).start()
        else:
            self._reply(query, Answer("joining"))

    def _wait(self, query: Query, verb: Callable[[Question], Answer], question: Question) -> None:
        try:
            self._reply(query, self._outcome(verb, question))
        finally:
            self._places.release()

    def _outcome(self, verb: Callable[[Question], Answer], question: Question) -> Answer:
        try:
            return verb(question)
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

    def _write(self, question: Question) -> Answer:
        batch = question.batch
        if batch is None:
            return Answer("refused", text="a write that writes nothing")
        changes: list[Change] = [(write.path, write.value) for write in batch.writes()]
        stamp = Stamp(batch.time, batch.clock)
        outcome = self._replica.write(
            changes, origin=batch.origin, stamp=stamp, timeout=min(question.timeout, _LONGEST)
        )
        return Answer(slow=list(outcome.slow))
