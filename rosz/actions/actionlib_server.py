"""Action servers: goals, each with a state of its own.

Clients of ROS 2 reach a server as well, if the definition of its action is found.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from typing import Any

from rosz.actions.translation import Ros2ToActionlib
from rosz.actions.types import ActionTypes, publish, run_callback
from rosz.errors import EncodeError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node
from rosz.node.actions import ACTIONLIB_STEPS, ActionlibState
from rosz.qos import LATCHED, QoS

_STATUS_FREQUENCY = 5.0
_STATUS_TIMEOUT = 5.0
_QUEUE_SIZE = 50
_CANCELLED_BEFORE = "This goal was canceled: it was sent before the last cancel request"

_numbers = itertools.count(1)


class ActionlibServerGoal:
    """A goal that was received; a program accepts it and ends it.

    Args:
        server: Its server.
        message: Message that carried it.

    Attributes:
        message: As given; None for a goal of which only the cancellation has arrived.
        status: State of the goal.
        ended_at: Time of its end in nanoseconds; 0 while it has not ended.
    """

    def __init__(self, server: ActionlibServer, message: Any) -> None:
        stamp, name = message.goal_id.stamp, message.goal_id.id
        if not stamp.to_nsec():
            stamp = Time.from_nsec(server.node.now())
        if not name:
            name = f"{server.node.name}-{next(_numbers)}-{stamp.sec}.{stamp.nanosec}"
        self.server: ActionlibServer = server
        self.message: Any = message
        self.status: GoalStatus = GoalStatus(GoalID(stamp, name), GoalStatus.PENDING)
        self.ended_at: int = 0

    @property
    def id(self) -> GoalID:
        """Identification of the goal in messages."""
        return self.status.goal_id

    def accept(self, text: str = "") -> None:
        """Begin to execute the goal."""
        with self.server.lock:
            state = self._next("accept")
            if state is not None:
                self.status.status, self.status.text = state, text
                self.server.update(self)

    def request_cancel(self) -> bool:
        """Note that a client wants the goal to end; return whether that is possible and new."""
        with self.server.lock:
            state = ACTIONLIB_STEPS["request_cancel"].get(ActionlibState(self.status.status))
            if state is None:
                return False
            self.status.status = int(state)
            self.server.update(self)
            return True

    def cancel(self, result: Any = None, text: str = "") -> None:
        """End the goal as recalled or preempted."""
        self._end("cancel", result, text)

    def reject(self, result: Any = None, text: str = "") -> None:
        """End the goal before it is accepted."""
        self._end("reject", result, text)

    def abort(self, result: Any = None, text: str = "") -> None:
        """End the goal as failed."""
        self._end("abort", result, text)

    def succeed(self, result: Any = None, text: str = "") -> None:
        """End the goal as reached."""
        self._end("succeed", result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback about the goal."""
        self.server.publish_feedback(self.status, feedback)

    def _next(self, step: str) -> int | None:
        steps, before = ACTIONLIB_STEPS[step], ActionlibState(self.status.status)
        state = steps.get(before)
        if state is None:
            self.server.node.log.error(
                "cannot %s a goal of action '%s': its state is %s; expected %s",
                step,
                self.server.name,
                before.name,
                " or ".join(state.name for state in steps),
            )
            return None
        return int(state)  # a plain number, since messages are printed

    def _end(self, step: str, result: Any, text: str) -> None:
        with self.server.lock:
            state = self._next(step)
            if state is None:
                return
            before, self.status = self.status, GoalStatus(self.id, state, text)
            try:
                self.server.publish_result(self.status, result)
            except EncodeError:
                self.status = before  # it can still be ended with a proper result
                raise
            self.ended_at = self.server.node.now()
            self.server.update(self, result)


class ActionlibServer:
    """Receive goals, and publish their states, feedback and results.

    Args:
        node: Node that the server belongs to.
        name: Name of the action; resolved and remapped.
        action_type: Class of the action, such as ``FibonacciAction``.
        on_goal: Function called with each `ActionlibServerGoal` that arrives.
        on_cancel: Function called with each goal that is requested to end.
        status_frequency: Rate in Hz at which states are published; with 0, only at changes.
        has_ros2: Whether clients of ROS 2 reach it too.

    Attributes:
        name: Full name of the action.
        status_timeout: Seconds for which the state of a goal that has ended is published.
        queue_size: Number of messages that wait to be sent.
        lock: Lock that is held while a goal changes, and while states are published.
        goals: The goals whose states are published.

    Raises:
        UsageError: The class is not that of an action.
    """

    _goal_class: type[ActionlibServerGoal] = ActionlibServerGoal

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: type[Any],
        on_goal: Callable[[Any], object] | None = None,
        on_cancel: Callable[[Any], object] | None = None,
        *,
        status_frequency: float = _STATUS_FREQUENCY,
        has_ros2: bool = True,
    ) -> None:
        self.types: ActionTypes = ActionTypes.of(action_type, node.context.types)
        self.node: Node = node
        self.name: str = node.resolve(name)
        self.on_goal = on_goal
        self.on_cancel = on_cancel
        self.lock = threading.RLock()
        self.goals: list[Any] = []
        self.status_frequency: float = status_frequency
        self.status_timeout: float = _STATUS_TIMEOUT
        self.queue_size: int = _QUEUE_SIZE
        self._callback_lock = threading.RLock()
        self._cancelled_until = 0
        self._cancelled_early: dict[str, int] = {}
        self._publishers: dict[str, Any] = {}
        self._others: list[Any] = []
        self._has_ros2 = has_ros2
        self._ros2: Ros2ToActionlib | None = None

    def start(self) -> None:
        """Begin to receive goals; a started server does nothing."""
        with self.lock:
            if self._publishers:
                return
            node, types, qos = self.node, self.types, QoS(depth=self.queue_size)
            kinds: dict[str, type[Any]] = {
                "status": GoalStatusArray,
                "result": types.action_result,
                "feedback": types.action_feedback,
            }
            self._publishers = {
                topic: node.publisher(
                    f"{self.name}/{topic}", kind, qos=LATCHED if topic == "status" else qos
                )
                for topic, kind in kinds.items()
            }
            self._others = [
                node.subscription(f"{self.name}/{topic}", kind, receive, queue_size=self.queue_size)
                for topic, kind, receive in (
                    ("cancel", GoalID, self._receive_cancel),
                    ("goal", types.action_goal, self._receive_goal),
                )
            ]
            if self.status_frequency > 0:
                period = 1 / self.status_frequency
                self._others.append(node.timer(period, lambda _: self.publish_status()))
            if types.action is not None and self._has_ros2:
                self._ros2 = node.keep(
                    Ros2ToActionlib(
                        node,
                        self.name,
                        types,
                        types.action,
                        self._receive_goal,
                        self._receive_cancel,
                    )
                )
                self._others.append(self._ros2)
            self.publish_status()  # clients take it for a sign that the server is ready

    def stop(self) -> None:
        """Stop receiving goals; a server that is not started does nothing."""
        with self.lock:
            entities = (*self._others, *self._publishers.values())
            self._others, self._publishers, self._ros2 = [], {}, None
        for entity in entities:  # which waits for callbacks, so without the lock
            entity.close()

    def update(self, goal: ActionlibServerGoal, result: Any = None) -> None:
        """Let clients know of the state of a goal, and of its result if it has ended."""
        self.publish_status()
        if self._ros2 is not None:
            self._ros2.update(goal.status, result)

    def publish_status(self) -> None:
        """Publish the states of all goals."""
        with self.lock:
            if not self._publishers:
                return
            oldest = self.node.now() - round(self.status_timeout * 1e9)
            self.goals[:] = [g for g in self.goals if not g.ended_at or g.ended_at > oldest]
            early = self._cancelled_early
            for name in [name for name, moment in early.items() if moment <= oldest]:
                del early[name]
            statuses = [goal.status for goal in self.goals]
            statuses += [GoalStatus(GoalID(id=name), GoalStatus.RECALLING) for name in early]
            self._publish("status", GoalStatusArray(self._header(), statuses))

    def publish_result(self, status: GoalStatus, result: Any = None) -> None:
        """Publish the result of a goal.

        Args:
            status: Final state of the goal.
            result: The result; an empty one when not given.

        Raises:
            EncodeError: The result is not one of the action.
        """
        outcome = result or self.types.result()
        self._publish("result", self.types.action_result(self._header(), status, outcome))

    def publish_feedback(self, status: GoalStatus, feedback: Any) -> None:
        """Publish feedback about a goal.

        Args:
            status: State of the goal.
            feedback: The feedback.

        Raises:
            EncodeError: The feedback is not one of the action.
        """
        self._publish("feedback", self.types.action_feedback(self._header(), status, feedback))
        if self._ros2 is not None:
            self._ros2.send_feedback(status.goal_id.id, feedback)

    def _publish(self, topic: str, message: Any) -> None:
        publisher = self._publishers.get(topic)
        if publisher is not None:
            publish(self.node, publisher, message)

    def _header(self) -> Header:
        return Header(stamp=Time.from_nsec(self.node.now()))

    def _receive_goal(self, message: Any) -> None:
        with self._callback_lock:
            with self.lock:
                name = message.goal_id.id
                if name and any(goal.id.id == name for goal in self.goals):
                    return  # sent twice
                goal = self._goal_class(self, message)
                self.goals.append(goal)
                if self._cancelled_early.pop(name, None) is not None:
                    goal.cancel()
                    return
                if 0 < message.goal_id.stamp.to_nsec() <= self._cancelled_until:
                    goal.cancel(text=_CANCELLED_BEFORE)
                    return
            run_callback(self.node, self.name, self.on_goal, goal)

    def _receive_cancel(self, message: GoalID) -> None:
        until = message.stamp.to_nsec()
        everything = not message.id and not until
        with self._callback_lock:
            with self.lock:
                cancelled = [
                    goal
                    for goal in self.goals
                    if (everything or goal.id.id == message.id or goal.id.stamp.to_nsec() <= until)
                    and goal.request_cancel()
                ]
                if message.id and all(goal.id.id != message.id for goal in self.goals):
                    self._cancelled_early[message.id] = self.node.now()
                self._cancelled_until = max(self._cancelled_until, until)
            for goal in cancelled:
                run_callback(self.node, self.name, self.on_cancel, goal)
