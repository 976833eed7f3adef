"""What is declared on a session, and how Zenoh's errors are told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol

import zenoh

from rosz.errors import ClosedError, TransportError
from rosz.session.samples import Sample

__all__ = ("Closable", "Declared", "RawPublisher", "Ring", "direct", "mapped")


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
        raise TransportError(f"cannot {what}: {text}") from error


def direct(callback: Callable[[Any], None]) -> Any:
    """Have a callback run right on Zenoh's thread instead of a Python thread per declaration."""
    return zenoh.handlers.Callback(callback, indirect=False)


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
        if entity is not None:
            # The session may end right now and take the declaration along.
            with suppress(ClosedError), mapped(f"undeclare {self._what}"):
                entity.undeclare()


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
        try:
            return Sample(self._recv())
        except zenoh.ZError as error:
            raise ClosedError(f"the subscriber of '{self._key}' is closed") from error


class RawPublisher(Declared):
    """A declared publisher of bytes."""

    def __init__(self, key: str, entity: Any) -> None:
        super().__init__(f"publisher '{key}'", entity)
        self.key = key
        self._put = entity.put

    def put(self, payload: bytes, attachment: bytes) -> None:
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
