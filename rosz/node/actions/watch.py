"""Noticing that the server of an action does not answer while it has goals.

A link that is cut counts as lost only 8 s later, since a shorter time splits busy machines. So the
client of an action by ROS 2's protocol queries the cache of the status topic as long as there are
goals. Zenoh's own threads answer there, in rosz and in rmw_zenoh, however busy the program of the
server is. By ROS 1's protocol, servers publish their status all the time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sized
from functools import partial

from rosz.errors import ClosedError, TransportError
from rosz.node.entity import Entity
from rosz.node.log import NodeLog
from rosz.session import Cancellation
from rosz.worker import Worker

LONGEST_SILENCE = 60.0
"""Seconds after which the goals of a server that is out of reach are given up."""

_PERIOD = 0.3
_TIMEOUT = 1.4
"""Seconds; with the period, a server that stops answering is noticed within 2 s."""

_DELAY = 0.3
"""Seconds by which a check is late only if this process is stopped or starved itself."""


class ServerWatch:
    """Tells whether the server of an action answers, as long as there are goals.

    Args:
        action: Full name of the action.
        goals: Function that returns the goals.
        on_check: Function called several times a second, on a thread of the watch.
        log: Where to report a server that does not answer.
        queries: Whether to query the server; otherwise its publications count as answers.
    """

    def __init__(
        self,
        action: str,
        goals: Callable[[], Sized],
        on_check: Callable[[], None],
        log: NodeLog,
        *,
        queries: bool,
    ) -> None:
        self._action = action
        self._goals = goals
        self._on_check = on_check
        self._log = log
        self._look = self._query if queries else self._wait
        self._lock = threading.Condition()
        self._closed = False
        self._watching = False
        self._silent = False
        self._heard = 0.0
        self._checked = 0.0
        self._cancel = Cancellation()
        self._worker: Worker[Callable[[], object]] = Worker(f"rosz-watch{action}")

    @property
    def silence(self) -> float:
        """Seconds since the server answered last; 0 as long as it answers."""
        return time.monotonic() - self._heard if self._silent else 0.0

    def begin(self, status: Entity) -> None:
        """Watch the server until there are no goals any more.

        Args:
            status: Subscription of the action's status topic.
        """
        with self._lock:
            if self._watching:
                return
            self._watching, self._silent = True, False
            self._heard = self._checked = time.monotonic()
        self._worker.later(_PERIOD, partial(self._check, status))

    def note_answer(self) -> None:
        """Note that something came from the server."""
        with self._lock:
            silence, self._silent, self._heard = self.silence, False, time.monotonic()
            self._lock.notify_all()
        if silence:
            text = "the server of action '%s' answers again after %.1f s"
            self._log.info(text, self._action, silence)

    def wait_for_answer(self) -> bool:
        """Wait until a silent server answers; return whether it did before its goals are given up.

        Raises:
            ClosedError: The watch was closed meanwhile.
        """
        with self._lock:
            left = LONGEST_SILENCE - self.silence
            answers = self._lock.wait_for(lambda: self._closed or not self._silent, left)
            if self._closed:
                raise ClosedError(f"the client of action '{self._action}' is closed")
            return answers

    def close(self) -> None:
        """End the watch; a second call has no effect."""
        with self._lock:
            self._closed = True
            self._lock.notify_all()
        self._cancel.cancel()
        self._worker.close()

    def _check(self, status: Entity) -> None:
        with self._lock:
            self._watching = bool(self._goals())
            if not self._watching:
                return
        try:
            if not self._look(status):
                self._note_silence(status)
            self._on_check()
        except (ClosedError, TransportError):
            return  # the session ends
        self._worker.later(_PERIOD, partial(self._check, status))

    def _query(self, status: Entity) -> bool:
        """Return whether the server answers a query, or nobody can say."""
        began = time.monotonic()
        if began - self._heard < _PERIOD:
            return True
        reply = status.node.context.session.query(
            f"{status.key}/@adv/pub/**",
            timeout=_TIMEOUT,
            parameters="_max=1;_anyke",
            any_key=True,
            priority="urgent",
            cancel=self._cancel,
        ).receive()
        if reply is not None and reply.ok:
            self.note_answer()
        elif reply is None or time.monotonic() - began > _TIMEOUT + _DELAY:
            self._begin_again()
        return self._heard >= began

    def _wait(self, _: Entity) -> bool:
        """Return whether the server has published something, or nobody can say."""
        now = time.monotonic()
        late, self._checked = now - self._checked > _PERIOD + _DELAY, now
        if late:
            self._begin_again()
        return now - self._heard < _TIMEOUT

    def _begin_again(self) -> None:
        """Count from now, unless the server is known to be silent."""
        with self._lock:
            if not self._silent:
                self._heard = time.monotonic()

    def _note_silence(self, status: Entity) -> None:
        with self._lock:
            if self._silent:
                return
            self._silent = True
        servers = [token.zid for token in status.others.view().publishers(status.name)]
        session = status.node.context.session
        why = session.why_silent(*servers) or "it is stopped or out of reach"
        self._log.warning(
            "no answer from the server of action '%s' for %.1f s: %s. Its goals are still followed",
            self._action,
            self.silence,
            why,
        )
