"""How long a wait may be told to last."""

from __future__ import annotations

import threading

from rosz.errors import UsageError

__all__ = ("LONGEST_WAIT", "clamp_timeout")

LONGEST_WAIT = threading.TIMEOUT_MAX / 2
"""Seconds, more than a century, that stand for "forever": no wait of the system takes more."""


def clamp_timeout(timeout: float) -> float:
    """Return how long to wait, for those who are told: from 0, for less, to `LONGEST_WAIT`.

    Args:
        timeout: Seconds; may be infinite.

    Raises:
        UsageError: It is no number, with which no wait would come to its end.
    """
    if timeout != timeout:  # noqa: PLR0124  # nan
        raise UsageError(f"timeout is '{timeout}': expected a number of seconds")
    return min(max(timeout, 0.0), LONGEST_WAIT)
