"""ros: other modules under one name (``from ros import rospy``), as roslib has it."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

__all__ = ()


def __getattr__(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise AttributeError(
            f"module 'ros' has no attribute '{name}': {error}", name=name
        ) from error
