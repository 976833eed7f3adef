"""What a session asks of others."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Unpack

import zenoh

from rosz.session.answers import Answers, AskOptions, Cancellation, Target
from rosz.session.declared import Asker, channel, mapped
from rosz.session.samples import Reply
from rosz.session.starting import start
from rosz.session.waiting import patience

__all__ = ("Asking",)

_TARGETS = {
    "all": zenoh.QueryTarget.ALL,
    "all_complete": zenoh.QueryTarget.ALL_COMPLETE,
    "best": zenoh.QueryTarget.BEST_MATCHING,
}


class Asking:
    """The asking half of a session."""

    _raw: Any

    def ask(
        self,
        key: str,
        *,
        timeout: float,
        payload: bytes | None = None,
        attachment: bytes | None = None,
        parameters: str = "",
        target: Target = "all",
        any_key: bool = False,
        cancel: Cancellation | None = None,
    ) -> Answers:
        """Ask, and have the answers to iterate over; one that is not ``ok`` is an error.

        Args:
            key: Key expression to ask for.
            timeout: Seconds after which whoever has not answered is given up; an answer that is not
                ``ok`` with payload ``Timeout`` stands for them.
            payload: Sent along with the question.
            attachment: Sent beside the payload.
            parameters: What follows the ``?`` of the selector.
            target: Who is asked.
            any_key: Whether answers may be for keys outside the one asked for.
            cancel: What may end it early.

        Raises:
            ClosedError: The session is closed, or it is cancelled already.
            TransportError: The key is malformed.
            UsageError: The timeout is no number.
        """
        with mapped(f"ask '{key}'"):
            handler = self._raw.get(
                f"{key}?{parameters}" if parameters else key,
                channel(),
                target=_TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY if any_key else None,
                timeout=patience(timeout),
                payload=payload,
                attachment=attachment,
                cancellation_token=None if cancel is None else cancel.token,
            )
        return Answers(handler)

    def asker(self, key: str, *, timeout: float, target: Target = "all") -> Asker:
        """Declare a question that is asked often; the arguments are those of `ask`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"ask '{key}'"):
            entity = self._raw.declare_querier(
                key,
                target=_TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=patience(timeout),
            )
        return Asker(key, entity, timeout)

    def get(self, key: str, *, timeout: float, **options: Unpack[AskOptions]) -> list[Reply]:
        """Ask, and wait for all answers; the arguments are those of `ask`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        return list(self.ask(key, timeout=timeout, **options))

    def get_async(
        self,
        key: str,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
        *,
        timeout: float,
        **options: Unpack[AskOptions],
    ) -> None:
        """Ask, and have the answers delivered on another thread.

        Args:
            key: Key expression to ask for.
            on_reply: Gets each answer.
            on_done: Called after the last answer, or when the time is over.
            timeout: As for `ask`.
            options: As for `ask`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        answers = self.ask(key, timeout=timeout, **options)

        def deliver() -> None:
            try:
                for reply in answers:
                    on_reply(reply)
            finally:
                on_done()

        if not start(threading.Thread(target=deliver, name=f"rosz answers '{key}'", daemon=True)):
            deliver()

    def live_tokens(self, key: str, timeout: float) -> list[str]:
        """Return the keys of all liveliness tokens that match, sorted.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"look for tokens '{key}'"):
            handler = self._raw.liveliness().get(key, channel(), timeout=patience(timeout))
        return sorted({reply.key for reply in Answers(handler) if reply.ok})
