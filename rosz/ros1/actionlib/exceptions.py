"""actionlib.exceptions: the error of a class that is not an action."""

from rosz.errors import UsageError as ActionException

__all__ = ("ActionException",)
