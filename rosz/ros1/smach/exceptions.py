"""smach.exceptions: the errors of smach, which write themselves to its log."""

from __future__ import annotations

from rosz.ros1.smach.log import logerr

__all__ = (
    "InvalidConstructionError",
    "InvalidStateError",
    "InvalidTransitionError",
    "InvalidUserCodeError",
    "SmachError",
)


class SmachError(Exception):
    """Base class of the errors of smach."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        logerr(f"{type(self).__name__}: {message}")


class InvalidTransitionError(SmachError):
    """A transition is missing, or leads nowhere."""


class InvalidStateError(SmachError):
    """A state or a container is not valid."""


class InvalidConstructionError(SmachError):
    """A container was changed while it was not open."""


class InvalidUserCodeError(SmachError):
    """A state or a callback of the program failed."""
