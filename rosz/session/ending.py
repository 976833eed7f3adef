"""What is left of a session after its end."""

from __future__ import annotations

from typing import Any

from rosz.errors import ClosedError

__all__ = ("ClosedSession", "still_open")


class ClosedSession:
    """Stands for Zenoh's session once it is closed, so that no call reaches it any more.

    Args:
        why: What the refusals say.
    """

    def __init__(self, why: str) -> None:
        self._why = why

    def __getattr__(self, name: str) -> Any:
        raise ClosedError(f"no {name.replace('_', ' ')} any more: {self._why}")


def still_open(raw: Any) -> Any:
    """Return Zenoh's session, to be handed to a function of Zenoh's that takes one.

    Raises:
        ClosedError: It is closed.
    """
    if isinstance(raw, ClosedSession):
        raw.declare()
    return raw
