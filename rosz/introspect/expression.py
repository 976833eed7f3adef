"""Filters that a person writes in Python: ``m.data > 3``, as rostopic takes them."""

from __future__ import annotations

import ast
from typing import Any

from rosz.errors import RoszError, UsageError

__all__ = ("Filter",)


class Filter:
    """Tells whether a message is wanted.

    Args:
        text: A Python expression of ``m``, the message, and ``topic``, its name.

    Raises:
        UsageError: It is no expression.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._code = compile(ast.parse(text.strip(), "<filter>", "eval"), "<filter>", "eval")
        except SyntaxError as error:
            place = f" at column {error.offset}" if error.offset else ""
            raise UsageError(
                f"filter '{text}' is no Python expression: {error.msg}{place}"
            ) from error

    def accepts(self, message: Any, topic: str = "") -> bool:
        """Tell whether a message is wanted.

        Raises:
            RoszError: The expression fails on this message.
        """
        try:
            return bool(eval(self._code, {"m": message, "topic": topic}))  # noqa: S307  # the user's
        except Exception as error:
            raise RoszError(
                f"filter '{self.text}' failed: {type(error).__name__}: {error}"
            ) from error
