"""roslaunch.substitution_args: ``$(find PKG)``, ``$(arg x)`` and the others in a text."""

from __future__ import annotations

from typing import Any

from rosz.launch.plan.document import TextError
from rosz.launch.plan.scope import Scope
from rosz.launch.plan.substitution import Substitution

__all__ = ("ArgException", "SubstitutionException", "resolve_args")


class SubstitutionException(Exception):
    """A substitution is malformed or has no value."""


class ArgException(SubstitutionException):
    """An arg is not set."""


def resolve_args(
    arg_str: str,
    context: dict[str, Any] | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """Return a text with its substitutions applied.

    Args:
        arg_str: The text.
        context: Values of args under ``arg``, and made names under ``anon``, which grow here.
        resolve_anon: Whether to apply ``$(anon x)``.
        filename: Path of the launch file, for ``$(dirname)``.

    Raises:
        ArgException: An arg is not set.
        SubstitutionException: A substitution is malformed or has no value.
    """
    from rosz.ros1.roslaunch.loader import plan_context

    if not arg_str or (not resolve_anon and "$(anon" in arg_str):
        return arg_str
    known = {} if context is None else context
    file = filename or known.get("filename") or ""
    if "$(dirname)" in arg_str and not file:
        raise SubstitutionException("$(dirname) needs the path of a launch file, and there is none")
    scope = Scope("/", file)
    scope.args = known.setdefault("arg", {})
    scope.anonymous = known.setdefault("anon", {})
    try:
        return Substitution(plan_context())(arg_str, scope)
    except TextError as error:
        unset = error.reason.startswith("arg '")
        raise (ArgException if unset else SubstitutionException)(error.reason) from error
