"""The exceptions of dynamic_reconfigure, by ROS 1's names."""

from __future__ import annotations

__all__ = (
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
)


class DynamicReconfigureException(Exception):
    """Base class of the exceptions of dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """There is no such parameter, or it cannot have a value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback returned nothing, or a server refused or did not reply."""
