"""What is declared on a session, and how Zenoh's errors are told."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol

import zenoh

from rosz.errors import ClosedError, TransportError
from rosz.session.answers import Answers, Cancellation
from rosz.session.calls import ENDING, keep
from rosz.session.samples import Query, Sample
from rosz.session.starting import start

__all__ = (
    "Asker",
    "Closable",
    "Declared",
    "Pumped",
    "Questions",
    "RawPublisher",
    "Ring",
    "channel",
    "mapped",
)

_CHANNEL = 1 << 20
"""Items that a channel holds: more than ever come before a thread of ours gets its turn."""

_log = logging.getLogger("rosz.session")


class Closable(Protocol):
    """Something declared on the session."""

    def close(self) -> None:
        """Undeclare it; again is no error."""


@contextmanager
def mapped(what: str) -> Iterator[None]:
    """Turn Zenoh's errors into ours, naming what was attempted."""
    try:
        yield
    except zenoh.ZError as error:
        text = str(error).partition(" at ")[0].strip()
        if "closed" in text.lower():
            raise ClosedError(f"cannot {what}: the session is closed") from error
        if "cancelled" in text:
            raise ClosedError(f"cannot {what}: it was cancelled") from error
        raise TransportError(f"cannot {what}: {text}") from error


def channel() -> Any:
    """Have what comes wait in a channel, so that Zenoh never waits for Python.

    To undeclare an advanced publisher Zenoh holds Python's lock, and waits for its inner work; and
    an interpreter that ends aborts when a thread which is not its own asks for its lock.
    """
    return zenoh.handlers.FifoChannel(_CHANNEL)


class Declared:
    """One declaration, undeclared at most once."""

    def __init__(self, what: str, entity: Any) -> None:
        self._what = what
        self._entity: Any = entity

    def close(self) -> None:
        """Undeclare it; again, or after the session, is no error.

        Nobody may be inside another method of it meanwhile.
        """
        entity, self._entity = self._entity, None
        if entity is None:
            return
        if ENDING.is_set():
            keep(entity)
        else:
            # The session may end right now and take the declaration along.
            with suppress(ClosedError), mapped(f"undeclare {self._what}"):
                entity.undeclare()
        del entity

    def __del__(self) -> None:
        """Undeclare what nobody closed."""
        if self._entity is not None:
            self.close()


class Pumped(Declared):
    """A declaration with a `channel`, and a thread that calls back for what comes.

    Args:
        what: Name for errors.
        entity: What was declared.
        deliver: Gets each item, on the thread; what it raises is logged.
    """

    def __init__(self, what: str, entity: Any, deliver: Callable[[Any], None]) -> None:
        super().__init__(what, entity)
        receive = entity.handler.recv
        start(
            threading.Thread(
                target=_pump, args=(what, receive, deliver), name=f"rosz {what}", daemon=True
            )
        )


def _pump(what: str, receive: Callable[[], Any], deliver: Callable[[Any], None]) -> None:
    while not ENDING.is_set():
        try:
            item = receive()
        except zenoh.ZError:  # undeclared, or the session is closed
            return
        try:
            deliver(item)
        except Exception:  # noqa: BLE001  # the callback boundary: the next item may fare better
            _log.exception("the callback of the %s failed", what)
        del item


class Ring(Declared):
    """A subscriber that keeps the newest samples until they are taken."""

    def __init__(self, key: str, entity: Any) -> None:
        super().__init__(f"subscriber '{key}'", entity)
        self._key = key
        self._recv = entity.handler.recv

    def take(self) -> Sample:
        """Return the oldest sample that is kept, waiting for one until the ring is closed.

        Raises:
            ClosedError: The ring or the session was closed.
        """
        if ENDING.is_set():
            raise ClosedError(f"the subscriber of '{self._key}' is closed")
        try:
            return Sample(self._recv())
        except zenoh.ZError as error:
            raise ClosedError(f"the subscriber of '{self._key}' is closed") from error


class Asker(Declared):
    """A question that is declared once and asked often.

    Args:
        key: Key expression.
        entity: What was declared.
        timeout: Seconds that were declared with it.

    Attributes:
        timeout: As given.
    """

    def __init__(self, key: str, entity: Any, timeout: float) -> None:
        super().__init__(f"querier '{key}'", entity)
        self._key = key
        self._get = entity.get
        self.timeout = timeout

    def ask(self, payload: bytes, attachment: bytes, cancel: Cancellation) -> Answers:
        """Ask, and have the answers to wait for; see `Session.ask`.

        Raises:
            ClosedError: The session is closed, or questions of this kind are cancelled.
        """
        try:
            handler = self._get(
                channel(), payload=payload, attachment=attachment, cancellation_token=cancel.token
            )
        except zenoh.ZError:
            with mapped(f"ask '{self._key}'"):
                raise
        return Answers(handler)


class Questions(Declared):
    """A queryable whose questions wait until they are taken."""

    def __init__(self, key: str, entity: Any) -> None:
        super().__init__(f"queryable '{key}'", entity)
        self._recv = entity.handler.recv

    def take(self) -> Query | None:
        """Return the oldest question, waiting for one; any number of threads may.

        Returns:
            The question, which whoever takes it closes; ``None`` when this is closed.
        """
        if ENDING.is_set():
            return None
        try:
            return Query(self._recv())
        except zenoh.ZError:
            return None


class RawPublisher(Declared):
    """A declared publisher of bytes."""

    def __init__(self, key: str, entity: Any) -> None:
        super().__init__(f"publisher '{key}'", entity)
        self.key = key
        self._put = entity.put

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        """Send one sample.

        Raises:
            ClosedError: The publisher or the session is closed.
            TransportError: It cannot be sent.
        """
        if self._entity is None:
            raise ClosedError(f"cannot publish on '{self.key}': the publisher is closed")
        try:
            self._put(payload, attachment=attachment)
        except zenoh.ZError:
            with mapped(f"publish on '{self.key}'"):
                raise

    @property
    def matched(self) -> bool:
        """Whether anybody is known to subscribe to what a publisher without cache sends.

        Raises:
            ClosedError: The publisher or the session is closed.
        """
        if self._entity is None:
            raise ClosedError(f"nobody hears '{self.key}': the publisher is closed")
        with mapped(f"look for subscribers of '{self.key}'"):
            return bool(self._entity.matching_status.matching)
