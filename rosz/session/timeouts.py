"""The longest time that a wait may be given."""

from __future__ import annotations

import threading

from rosz.errors import UsageError

__all__ = ("LONGEST_WAIT", "clamp_timeout")

LONGEST_WAIT = threading.TIMEOUT_MAX / 2
"""Seconds that stand for "forever": more than a century, and the longest wait of the system."""


def clamp_timeout(timeout: float) -> float:
    """Return a timeout between 0 and `LONGEST_WAIT`.

    Args:
        timeout: Time limit in seconds; may be infinite.

    Raises:
        UsageError: The timeout is not a number, with which a wait would never end.
    """
    if timeout != timeout:  # noqa: PLR0124  # nan
        raise UsageError(f"timeout is '{timeout}': expected a number of seconds")
    return min(max(timeout, 0.0), LONGEST_WAIT)
