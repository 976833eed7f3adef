"""actionlib.action_server: receiving goals, many or one at a time (ROS wiki, actionlib)."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

from rosz import actions, names
from rosz.actions import ActionlibServerGoal as ServerGoal
from rosz.errors import EncodeError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.ros1 import state
from rosz.ros1.client import rospy
from rosz.ros1.exceptions import ROSSerializationException, raised_as

__all__ = ("ActionServer", "nop_cb")


class ServerGoalHandle(ServerGoal):
    """A goal that was received; without a message a handle of no goal.

    Args:
        action_server: Its server.
        message: Message that carried it.
    """

    def __init__(self, action_server: Any = None, message: Any = None) -> None:
        if message is not None:
            super().__init__(action_server, message)
        else:
            self.server, self.message = action_server, None
            self.status, self.ended_at = GoalStatus(), 0

    @property
    def goal(self) -> Any:
        """The message that carried the goal; None for no goal."""
        return self.message

    @property
    def action_server(self) -> Any:
        """The server of the goal."""
        return self.server

    def get_default_result(self) -> Any:
        """Return an empty result message."""
        return self.server.types.result()

    def accept(self, text: str = "") -> None:
        """Begin to execute the goal."""
        if self._is_set():
            super().accept(text)

    set_accepted = accept
    set_canceled = ServerGoal.cancel
    set_rejected = ServerGoal.reject
    set_aborted = ServerGoal.abort
    set_succeeded = ServerGoal.succeed

    def set_cancel_requested(self) -> bool:
        """Note that a client wants the goal to end; return whether that is possible and new."""
        return self.message is not None and self.request_cancel()

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback about the goal.

        Raises:
            ROSSerializationException: The feedback is not one of the action.
        """
        if self._is_set():
            with raised_as(ROSSerializationException, EncodeError):
                super().publish_feedback(feedback)

    def get_goal(self) -> Any:
        """Return the goal; None for no goal."""
        return None if self.message is None else self.message.goal

    def get_goal_id(self) -> GoalID:
        """Return the identification of the goal; an empty one for no goal."""
        return self.id if self._is_set() else GoalID()

    def get_goal_status(self) -> GoalStatus:
        """Return the state of the goal; an empty one for no goal."""
        return self.status if self._is_set() else GoalStatus()

    def _is_set(self) -> bool:
        if self.message is None:
            rospy.logerr("a goal handle without a goal was used")
        return self.message is not None

    def _end(self, step: str, result: Any, text: str) -> None:
        if self._is_set():
            with raised_as(ROSSerializationException, EncodeError):
                super()._end(step, result, text)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle) or self.goal is None or other.goal is None:
            return False
        return self.id.id == other.id.id

    def __hash__(self) -> int:
        return hash(self.id.id)


_numbers = itertools.count(1)


class GoalIDGenerator:
    """Makes identifications of goals, which are unique.

    Args:
        name: Name to begin them with; that of the node when not given.
    """

    def __init__(self, name: str | None = None) -> None:
        self.name: str = rospy.get_name() if name is None else name

    def set_name(self, name: str) -> None:
        """Set the name to begin identifications with."""
        self.name = name

    def generate_ID(self) -> GoalID:  # noqa: N802  # ROS 1's
        """Return a new identification with the current time."""
        now = rospy.Time.now()
        return GoalID(now, f"{self.name}-{next(_numbers)}-{now.secs}.{now.nsecs}")


class HandleTrackerDeleter:
    """Function that notes the end of a goal.

    Args:
        action_server: Server of the goal.
        status_tracker: State of the goal.
    """

    def __init__(self, action_server: Any, status_tracker: Any) -> None:
        self.action_server: Any = action_server
        self.status_tracker: Any = status_tracker

    def __call__(self, ptr: Any) -> None:  # noqa: ARG002
        """Note the time."""
        if self.action_server:
            with self.action_server.lock:
                self.status_tracker.handle_destruction_time = rospy.Time.now()


class StatusTracker:
    """The state of a goal.

    Args:
        goal_id: Identification of the goal, together with ``status``.
        status: Its state.
        goal: Message that carried it, instead of both.

    Attributes:
        status: State of the goal.
        handle_tracker: Whatever a program keeps here.
        handle_destruction_time: When the goal ended; 0 while it has not.
        id_generator: Makes identifications.
    """

    def __init__(self, goal_id: Any = None, status: Any = None, goal: Any = None) -> None:
        self.goal: Any = None
        self.handle_tracker: Any = None
        self.status: Any = GoalStatus()
        self.handle_destruction_time: Any = rospy.Time()
        self.id_generator = GoalIDGenerator()
        if goal_id:
            self.status.goal_id, self.status.status = goal_id, status
            return
        self.goal = goal
        self.status.goal_id = goal.goal_id
        if not goal.goal_id.id:
            self.status.goal_id = self.id_generator.generate_ID()
        if self.status.goal_id.stamp == rospy.Time():
            self.status.goal_id.stamp = rospy.Time.now()


_QUEUE_SIZE = 50
_FREQUENCY = 5.0
_TIMEOUT = 5.0


def nop_cb(goal_handle: Any) -> None:
    """Do nothing with a goal."""


class _LaterNode:
    """The node of the process before ``init_node``."""

    context = property(lambda _: state.context())
    resolve = staticmethod(rospy.resolve_name)

    def __getattr__(self, name: str) -> Any:
        return getattr(state.node(), name)


class ActionServer(actions.ActionlibServer):
    """Receive goals, and publish their states, feedback and results.

    Args:
        ns: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.
        goal_cb: Function called with the handle of each goal that arrives.
        cancel_cb: Function called with the handle of each goal that is requested to end.
        auto_start: Whether the server starts at once, and not with `start`.

    Attributes:
        ActionGoal: Class of the messages that carry goals.
        ActionResult: Class of the messages that carry results.
        ActionFeedback: Class of the messages that carry feedback.
        ActionResultType: Class of the results.
        started: Whether the server receives goals.

    Raises:
        ROSInitException: ``auto_start`` is true, and ``rospy.init_node`` was not called.
        ActionException: The class is not that of an action.
    """

    _goal_class = ServerGoalHandle

    def __init__(
        self,
        ns: str,
        ActionSpec: type[Any],  # noqa: N803  # ROS 1's
        goal_cb: Callable[[Any], object],
        cancel_cb: Callable[[Any], object] = nop_cb,
        auto_start: bool = True,
    ) -> None:
        node: Any = state.state.node or _LaterNode()
        super().__init__(node, names.canonical(ns), ActionSpec, goal_cb, cancel_cb)
        queue_size = int(rospy.get_param("actionlib_server_pub_queue_size", _QUEUE_SIZE))
        self.queue_size = _QUEUE_SIZE if queue_size < 0 else queue_size
        parameter = rospy.search_param("actionlib_status_frequency")
        frequency = _FREQUENCY if parameter is None else rospy.get_param(parameter, _FREQUENCY)
        self.status_frequency = float(rospy.get_param(f"{self.name}/status_frequency", frequency))
        self.status_timeout = float(rospy.get_param(f"{self.name}/status_list_timeout", _TIMEOUT))
        self.ns: str = ns
        self.ActionSpec: type[Any] = ActionSpec
        self.ActionGoal: type[Any] = self.types.action_goal
        self.ActionResult: type[Any] = self.types.action_result
        self.ActionFeedback: type[Any] = self.types.action_feedback
        self.ActionResultType: type[Any] = self.types.result
        self.started: bool = False
        if auto_start:
            self.start()

    @property
    def status_list(self) -> list[Any]:
        """The goals whose states are published."""
        return self.goals

    def start(self) -> None:
        """Begin to receive goals; a started server does nothing."""
        if isinstance(self.node, _LaterNode):
            self.node = state.node()
            self.name = self.node.resolve(names.canonical(self.ns))  # a private one is known now
        super().start()
        self.started = True

    def stop(self) -> None:
        """Stop receiving goals; a server that is not started does nothing."""
        self.started = False
        super().stop()

    def register_goal_callback(self, cb: Callable[[Any], object]) -> None:
        """Replace the function that is called with goals."""
        self.on_goal = cb

    def register_cancel_callback(self, cancel_cb: Callable[[Any], object]) -> None:
        """Replace the function that is called with goals that are requested to end."""
        self.on_cancel = cancel_cb


class SimpleActionServer(actions.SimpleActionServer):
    """Execute one goal at a time; a newer goal preempts the current one.

    The errors are those of `ActionServer`.

    Args:
        name: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.
        execute_cb: Function called with each goal on a thread of its own. It must end with
            `set_succeeded`, `set_aborted` or `set_preempted`. Without one, use
            `register_goal_callback` and `accept_new_goal`.
        auto_start: Whether the server starts at once, and not with `start`.
    """

    def __init__(
        self,
        name: str,
        ActionSpec: type[Any],  # noqa: N803  # ROS 1's
        execute_cb: Callable[[Any], object] | None = None,
        auto_start: bool = True,
    ) -> None:
        super().__init__(ActionServer(name, ActionSpec, nop_cb, nop_cb, False), execute_cb)
        self.current_goal = ServerGoalHandle()
        self.next_goal = ServerGoalHandle()
        if auto_start:
            self.start()

    def register_goal_callback(self, cb: Callable[[], object]) -> None:
        """Call a function when there is a new goal to accept."""
        if self.execute_callback is not None:
            rospy.logwarn(
                "register_goal_callback() has no effect: the server has an execute callback"
            )
        else:
            self.on_goal = cb

    def register_preempt_callback(self, cb: Callable[[], object]) -> None:
        """Call a function when the goal is asked to end."""
        self.on_preempt = cb
