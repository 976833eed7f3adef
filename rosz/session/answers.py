"""The answers to a question, as they come."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, TypedDict

import zenoh

from rosz.session.calls import ENDING
from rosz.session.samples import Reply

__all__ = ("Answers", "AskOptions", "Cancellation", "Target")

Target = Literal["all", "all_complete", "best"]
"""Who is asked: all who may answer, those who have all there is, or the best of them."""


class AskOptions(TypedDict, total=False):
    """What may be said with a question; see `Session.ask`."""

    payload: bytes | None
    attachment: bytes | None
    parameters: str
    target: Target
    any_key: bool
    cancel: Cancellation | None


class Cancellation:
    """Ends all questions that are asked with it, and refuses those to come.

    Attributes:
        token: Zenoh's.
    """

    def __init__(self) -> None:
        self.token = zenoh.CancellationToken()

    def cancel(self) -> None:
        """Expect no more answers: who waits for some is done; from any thread, again no error."""
        self.token.cancel()  # type: ignore[no-untyped-call]  # zenoh's stub lacks it


class Answers:
    """Iterate over it for the answers; it ends with the last one, or when the time is over.

    Args:
        handler: Zenoh's channel of replies.
    """

    def __init__(self, handler: Any) -> None:
        self._recv = handler.recv

    def __iter__(self) -> Iterator[Reply]:
        while (reply := self.first()) is not None:
            yield reply

    def first(self) -> Reply | None:
        """Wait for the next answer and return it; ``None`` when there is none."""
        if ENDING.is_set():
            return None
        try:
            return Reply(self._recv())
        except zenoh.ZError:  # the channel is empty, and nothing more will come
            return None
