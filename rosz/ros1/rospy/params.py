"""The parameter functions of rospy (ROS wiki, rospy/Overview/Parameter Server)."""

from __future__ import annotations

from typing import Any

from rosz.errors import InvalidName, ParamError, ParamNotFound
from rosz.ros1.rospy.exceptions import ROSException
from rosz.ros1.rospy.names import get_namespace
from rosz.ros1.rospy.state import params

__all__ = (
    "delete_param",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "has_param",
    "search_param",
    "set_param",
)

_UNSET: Any = object()


def get_param(param_name: str, default: Any = _UNSET) -> Any:
    """Return a parameter.

    Args:
        param_name: Its name; that of a namespace returns all below it as a dictionary.
        default: What to return when it is not set.

    Raises:
        KeyError: It is not set, and there is no default.
    """
    if not isinstance(param_name, str) and param_name is not None:
        if default is _UNSET:
            raise KeyError(param_name)
        return default
    try:
        return params().get(_full(param_name))
    except (ParamNotFound, InvalidName):
        if default is not _UNSET:
            return default
        raise KeyError(param_name) from None


get_param_cached = get_param
"""Reading is always a look-up in the memory of the process."""


def set_param(param_name: str, param_value: Any) -> None:
    """Set a parameter; a dictionary replaces all that was below the name.

    Raises:
        TypeError: The value is none that a parameter may have.
    """
    if not isinstance(param_name, str):
        raise TypeError(f"expected a name, got {type(param_name).__name__} {param_name!r}")
    try:
        params().set(_full(param_name), param_value)
    except ParamError as error:
        raise TypeError(str(error)) from error


def has_param(param_name: str) -> bool:
    """Tell whether a parameter, or anything below the name, is set."""
    return params().has(_full(param_name))


def delete_param(param_name: str) -> None:
    """Delete a parameter and all below it.

    Raises:
        KeyError: It is not set.
    """
    try:
        params().delete(_full(param_name))
    except (ParamNotFound, ParamError):
        raise KeyError(param_name) from None


def search_param(param_name: str) -> str | None:
    """Look for a parameter in the node's namespace, then in each one above it.

    Args:
        param_name: Relative name.

    Returns:
        The global name found, or None.

    Raises:
        ROSException: The name is private.
    """
    if not param_name:
        return None
    try:
        return params().search(param_name)
    except ParamError as error:
        raise ROSException(str(error)) from error


def get_param_names() -> list[str]:
    """Return the global names of all parameters."""
    return params().names()


def _full(name: str | None) -> str:
    return name or get_namespace()
