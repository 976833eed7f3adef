"""The default context and the global executor of rclpy, whose functions mean one process.

Like rospy's state, it is the only place that remembers anything; all else takes a context.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosz.ros2.rclpy.context import Context
    from rosz.ros2.rclpy.executors import Executor

__all__ = ("default_context", "global_executor")


class _Held:
    def __init__(self) -> None:
        self.context: Context | None = None
        self.executor: Executor | None = None


_held = _Held()


def default_context() -> Context:
    """Return the context that is meant when none is given."""
    if _held.context is None:
        from rosz.ros2.rclpy.context import Context

        _held.context = Context()
    return _held.context


def global_executor() -> Executor:
    """Return the executor that is meant when none is given, for the context as it is now."""
    from rosz.ros2.rclpy.executors import SingleThreadedExecutor

    if _held.executor is None:
        _held.executor = SingleThreadedExecutor()
    return _held.executor
