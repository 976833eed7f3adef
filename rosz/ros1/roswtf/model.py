"""roswtf.model: errors and warnings."""

from __future__ import annotations

from typing import Any

__all__ = ("WtfError", "WtfWarning")


class _Problem:
    """A finding of a rule.

    Attributes:
        msg: Text.
        format_msg: Text before values were filled in.
        return_val: What the rule returned.
    """

    def __init__(self, msg: str, format_msg: str | None = None, return_val: Any = None) -> None:
        self.msg = msg
        self.format_msg = msg if format_msg is None else format_msg
        self.return_val = True if return_val is None else return_val


class WtfError(_Problem):
    """An error."""


class WtfWarning(_Problem):
    """A warning."""
