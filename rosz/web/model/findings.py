"""Findings of the doctor, looked for again and again while a page shows them."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from rosz.doctor import Examination, Finding, examine
from rosz.errors import RoszError
from rosz.worker import Worker, run_task

if TYPE_CHECKING:
    from rosz.environment import Environment

__all__ = ("Findings",)

_PERIOD = 30.0
_LISTEN = 0.5
_log = logging.getLogger("rosz.web")


class Findings:
    """Examines the system twice a minute until it is closed.

    Args:
        environment: Settings of this machine.

    Attributes:
        found: The findings, or None before the first examination has ended.
        fault: Why the last examination failed; empty if it did not.
        looked: When the last one ended, in seconds of the monotonic clock.
    """

    def __init__(self, environment: Environment) -> None:
        self.found: tuple[Finding, ...] | None = None
        self.fault: str = ""
        self.looked: float = 0.0
        self._environment = environment
        self._worker = Worker("rosz-web-doctor", run_task, logger=_log)
        self._worker.submit(self._look)

    def _look(self) -> None:
        found: list[Finding] = []
        fault = ""
        try:
            for one in examine(Examination(environment=self._environment, listen=_LISTEN)):
                found.append(one)
                if self._worker.closed:
                    return
        except RoszError as error:
            fault = str(error)
        self.found, self.fault, self.looked = tuple(found), fault, time.monotonic()
        self._worker.later(_PERIOD, self._look)

    def close(self) -> None:
        """End it, without waiting for an examination that goes on."""
        self._worker.close(timeout=0)
