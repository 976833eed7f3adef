"""roswtf.rules: rules that return what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.ros1.roswtf.context import WtfContext
from rosz.ros1.roswtf.model import WtfError, WtfWarning

__all__ = ("error_rule", "warning_rule")

Rule = tuple[Callable[..., Any], str]
"""A function that returns what is wrong, and the text that says so."""


def warning_rule(rule: Rule, ret: Any, ctx: WtfContext) -> None:
    """Add a warning to a context, if a rule returned anything.

    Args:
        rule: The rule; names such as ``%(pkg)s`` in its text are attributes of the context.
        ret: What it returned: a list of texts, a text, or whether anything is wrong.
        ctx: The context.
    """
    if ret:
        ctx.warnings.append(WtfWarning(_text(rule, ret, ctx), rule[1], ret))


def error_rule(rule: Rule, ret: Any, ctx: WtfContext) -> None:
    """Add an error to a context, if a rule returned anything; see `warning_rule`."""
    if ret:
        ctx.errors.append(WtfError(_text(rule, ret, ctx), rule[1], ret))


def _text(rule: Rule, ret: Any, ctx: WtfContext) -> str:
    values = ctx.as_dictionary()
    text = rule[1] % values
    if isinstance(ret, tuple | list):
        return text + "\n" + "\n".join(f" * {one}" for one in ret) + "\n"
    return text + ret % values if isinstance(ret, str) else text
