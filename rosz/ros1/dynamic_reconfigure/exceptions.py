"""What dynamic_reconfigure raises, by ROS 1's names."""

from __future__ import annotations

__all__ = (
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
)


class DynamicReconfigureException(Exception):
    """Root of what dynamic_reconfigure raises."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """There is no such parameter, or a value cannot be one of it."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback returned nothing, or a server refused or did not answer."""
