"""Filters that a person writes in Python: ``m.data > 3``, as rostopic takes them."""

from __future__ import annotations

import ast
from typing import Any

from rosz.errors import RoszError, UsageError

__all__ = ("Filter",)

_FEW = 100


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
            raise self._refused(f"{error.msg}{place}") from error
        except ValueError as error:
            raise self._refused(str(error)) from error
        except (MemoryError, RecursionError) as error:
            raise self._refused("it is nested too deep") from error

    def _refused(self, reason: str) -> UsageError:
        return UsageError(f"filter '{self.text:.{_FEW}}' is no Python expression: {reason}")

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
