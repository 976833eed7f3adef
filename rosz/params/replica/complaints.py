"""Saying of damage from the network what it is, once for each kind: senders of it send much."""

from __future__ import annotations

import logging

from rosz.errors import DecodeError

__all__ = ("AHEAD", "NO_PARAMETER", "SAVED_AHEAD", "Complaints")

NO_PARAMETER = "a replica wrote what is no parameter"
AHEAD = "a replica wrote what is not taken in"
SAVED_AHEAD = "what was saved counts as written just now"

_log = logging.getLogger("rosz.params")


class Complaints:
    """What was complained of so far."""

    def __init__(self) -> None:
        self._kinds: set[tuple[str, str]] = set()

    def tell(self, what: str, error: DecodeError) -> None:
        """Warn of damage, unless that kind of it was warned of before.

        Args:
            what: What is wrong with it, such as `NO_PARAMETER`.
            error: How it could not be read.
        """
        kind = (what, error.type_name)
        if kind not in self._kinds:
            self._kinds.add(kind)
            _log.warning("%s (told once): %.300s", what, error)
