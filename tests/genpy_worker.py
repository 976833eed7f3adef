"""Answers requests with real genpy, under the interpreter that ROS 1 is installed for.

Reads a line of JSON, writes a line of JSON: ``{"expression": …}`` is evaluated with genpy's Time
and Duration; ``{"type": …, "args": …, "now": …, "width": …, …}`` is filled and shown.
"""

# mypy: disable-error-code="import-not-found"
from __future__ import annotations

import json
import sys
from typing import Any

import genpy
import genpy.message

NAMES = {"Time": genpy.Time, "Duration": genpy.Duration}


def shown(value: Any) -> Any:
    if isinstance(value, genpy.TVal):
        return [type(value).__name__, value.secs, value.nsecs, str(value)]
    return [
        type(value).__name__,
        value if not isinstance(value, tuple) else list(map(shown, value)),
    ]


def evaluate(expression: str) -> Any:
    return shown(eval(expression, dict(NAMES)))


def fill(request: dict[str, Any]) -> Any:
    message = genpy.message.get_message_class(request["type"])()
    keys = {}
    if request.get("now"):
        from std_msgs.msg import Header

        now = genpy.Time(*request["now"])
        keys = {"now": now, "auto": Header(stamp=now)}
    genpy.message.fill_message_args(message, request["args"], keys)
    offset = request.get("offset")
    return genpy.message.strify_message(
        message,
        time_offset=genpy.Time(*offset) if offset else None,
        field_filter=(lambda _: request["fields"]) if request.get("fields") else None,
        fixed_numeric_width=request.get("width"),
    )


def main() -> None:
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if "expression" in request:
                answer = {"value": evaluate(request["expression"])}
            else:
                answer = {"value": fill(request)}
        except Exception as error:  # noqa: BLE001  # the answer is which one it is
            answer = {"error": type(error).__name__, "text": str(error)}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
