"""What is left of a session after its end."""

from __future__ import annotations

from typing import Any

from rosz.errors import ClosedError

__all__ = ("ClosedSession",)


class ClosedSession:
    """Stands for Zenoh's session once it is closed, so that no call reaches it any more.

    Args:
        why: What the refusals say.
    """

    def __init__(self, why: str) -> None:
        self._why = why

    def __getattr__(self, name: str) -> Any:
        raise ClosedError(f"no {name.replace('_', ' ')} any more: {self._why}")
