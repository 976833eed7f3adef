"""Lets ROS 1 programs derive classes from messages: ``class Wrapper(DiagnosticStatus)``.

A class statement takes the metaclass of its bases, and that of messages refuses an ``__init__``.
So in processes that import ROS 1's names, the function behind the statement chooses another one.
"""

from __future__ import annotations

import builtins
from typing import Any

__all__ = ("install",)

_plain = builtins.__build_class__


def install() -> None:
    """Let class statements derive from messages; again does nothing."""
    builtins.__build_class__ = _build


def _build(body: Any, name: str, /, *bases: Any, **options: Any) -> Any:
    if "metaclass" not in options and any(getattr(base, "_schema", None) for base in bases):
        from rosz.message import Derived

        options["metaclass"] = Derived
    return _plain(body, name, *bases, **options)
