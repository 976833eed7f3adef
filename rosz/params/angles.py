"""Angles in YAML, as rosparam reads them: ``deg(90)``, ``rad(pi/2)``, ``!radians 2*pi``.

rosparam hands the text of a radian to the interpreter. Here it is arithmetic and nothing else:
numbers, ``pi``, ``+ - * / // % **``, parentheses, and functions and constants of ``math``.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from typing import Any, Final

__all__ = ("degrees", "radians")

_LONGEST: Final = 200
"""Characters in an expression: the parser is not for texts that mean harm."""
_BINARY: Final[dict[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_UNARY: Final[dict[type[ast.unaryop], Callable[[Any], Any]]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}


def degrees(text: str) -> float:
    """Return an angle given in degrees, ``90`` or ``deg(90)``, in radians.

    Raises:
        ValueError: It is no number.
    """
    inner = text.strip()[4:-1] if text.startswith("deg(") else text
    try:
        return float(inner) * math.pi / 180.0
    except ValueError:
        raise ValueError(f"'{text}' is no angle in degrees; expected a number") from None


def radians(text: str) -> float:
    """Return an angle given in radians, ``pi/2`` or ``rad(pi/2)``.

    Raises:
        ValueError: It is no arithmetic, or has no finite real value.
    """
    stripped = text.strip()
    inner = stripped[4:-1] if stripped.startswith("rad(") else stripped
    try:
        return float(_evaluate(_parse(inner.strip())))
    except (ArithmeticError, SyntaxError, TypeError, ValueError):
        raise ValueError(
            f"'{text}' is no angle in radians; expected arithmetic with numbers and pi"
        ) from None


def _parse(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise ValueError
    return ast.parse(text, mode="eval").body


def _evaluate(node: ast.expr) -> float:
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        return float(_UNARY[type(node.op)](_evaluate(node.operand)))
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return float(_BINARY[type(node.op)](_evaluate(node.left), _evaluate(node.right)))
    if isinstance(node, ast.Call) and not node.keywords:
        return float(_of_math(node.func)(*(_evaluate(argument) for argument in node.args)))
    return float(_of_math(node))


def _of_math(node: ast.expr) -> Any:
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        found = getattr(math, node.attr, None)
        if node.value.id == "math" and found is not None and not node.attr.startswith("_"):
            return found
    raise ValueError
