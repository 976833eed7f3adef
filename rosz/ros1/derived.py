"""Lets ROS 1 programs derive classes from messages: ``class Wrapper(DiagnosticStatus)``.

A class statement takes the metaclass of its bases, and that of messages refuses an ``__init__``.
So in processes that import ROS 1's names, the function behind the statement chooses another one.

Nothing less wide does it. ``__init_subclass__`` is called after the refusal. A metaclass of
messages that does not refuse, even without a ``__call__``, triples the time that they take to make
with keywords in Python 3.11, where a class made by Python code does not inherit the vectorcall of
its base. A ``__builtins__`` of their own for the modules that rosz loads would miss those that
Python finds on ``sys.path``.
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
