"""Functions of real genpy; each returns its value, or the error of genpy."""

# mypy: ignore-errors
from __future__ import annotations

from typing import Any

import genpy
import genpy.message
from std_msgs.msg import Header


def _shown(value: Any) -> Any:
    if isinstance(value, genpy.TVal):
        return [type(value).__name__, value.secs, value.nsecs, str(value)]
    plain = list(map(_shown, value)) if isinstance(value, tuple) else value
    return [type(value).__name__, plain]


def evaluate(expression: str) -> dict[str, Any]:
    """Evaluate an expression with genpy's Time and Duration."""
    try:
        return {"value": _shown(eval(expression, {"Time": genpy.Time, "Duration": genpy.Duration}))}
    except Exception as error:  # noqa: BLE001  # the result is which one it is
        return {"error": type(error).__name__}


def text(
    type_name: str,
    args: Any,
    *,
    now: Any = None,
    offset: Any = None,
    fields: Any = None,
    width: Any = None,
) -> dict[str, Any]:
    """Fill a message, and return its text."""
    try:
        message = genpy.message.get_message_class(type_name)()
        keys = {}
        if now:
            stamp = genpy.Time(*now)
            keys = {"now": stamp, "auto": Header(stamp=stamp)}
        genpy.message.fill_message_args(message, args, keys)
        shown = genpy.message.strify_message(
            message,
            time_offset=genpy.Time(*offset) if offset else None,
            field_filter=(lambda _: fields) if fields else None,
            fixed_numeric_width=width,
        )
    except Exception as error:  # noqa: BLE001  # the result is which one it is
        return {"error": type(error).__name__, "text": str(error)}
    return {"value": shown}
