"""rclpy.action: servers and clients of actions; callbacks run while an executor spins the node.

A goal that was accepted counts as executing also while ``handle_accepted_callback`` defers it.
"""

from __future__ import annotations

import threading
import uuid
from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Any

from rosz import actions
from rosz.actions import ClientGoal, GoalState, ServerGoal
from rosz.errors import GoalFailed, GoalRejected, UsageError, WaitTimeout
from rosz.msgs.action_msgs.msg import GoalInfo, GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.ros2.rclpy.executors import CallbackGroup, Future, completed, in_background
from rosz.session import LONGEST_WAIT as _LONGEST_WAIT

_CHECK_PERIOD = 0.5
"""Seconds after which a goal that waits for an executor checks whether the node has ended."""


class GoalResponse(Enum):
    """What a goal callback returns."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """What a cancel callback returns."""

    REJECT = 1
    ACCEPT = 2


class ServerGoalHandle:
    """A goal that a server has accepted."""

    def __init__(self, server: ActionServer, goal: ServerGoal) -> None:
        self._server = server
        self._goal = goal
        self._outcome: GoalState | None = None
        self.finished = threading.Event()

    @property
    def request(self) -> Any:
        """The goal message."""
        return self._goal.request

    @property
    def goal_id(self) -> UUID:
        """Identification of the goal."""
        return UUID(self._goal.id.bytes)

    @property
    def status(self) -> int:
        """The state of the goal, a constant of ``GoalStatus``."""
        return int(self._outcome or self._goal.status)

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return self._outcome is None and not self._goal.done

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a client has asked for the end of the goal."""
        return self.is_active and self._goal.cancel_requested

    def execute(self, execute_callback: Callable[[Any], Any] | None = None) -> None:
        """Execute the goal, for servers whose ``handle_accepted_callback`` defers this."""
        self._server.execute(self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback.

        Raises:
            EncodeError: A value does not fit its field.
            UsageError: It is not a feedback message of the action.
        """
        expected = self._server.action_type.Feedback
        if not isinstance(feedback, expected):
            raise UsageError(f"got {type(feedback).__name__}, expected {expected.__name__}")
        self._goal.feedback(feedback)

    def succeed(self) -> None:
        """Mark the goal as reached; the callback returns its result.

        Raises:
            UsageError: The goal has ended before.
        """
        self._end(GoalState.SUCCEEDED)

    def abort(self) -> None:
        """Mark the goal as failed; see `succeed`."""
        self._end(GoalState.ABORTED)

    def canceled(self) -> None:
        """Mark the goal as cancelled, if a client asked for that; see `succeed`."""
        if not self._goal.cancel_requested:
            raise UsageError("nobody asked to cancel the goal")
        self._end(GoalState.CANCELED)

    def _end(self, state: GoalState) -> None:
        if not self.is_active:
            raise UsageError(f"the goal cannot become {state.text}: it has ended")
        self._outcome = state

    def finish(self, result: Any) -> None:
        """Send the result; for the server."""
        if self._outcome is GoalState.SUCCEEDED:
            self._goal.succeed(result)
        elif self._outcome is GoalState.CANCELED:
            self._goal.canceled(result)
        else:
            self._goal.abort(result)

    def destroy(self) -> None:
        """Do nothing: the server forgets a goal in time."""


class ActionServer:
    """Serve an action.

    Args:
        node: Node of rclpy.
        action_type: Class of the action.
        action_name: Name of the action.
        execute_callback: Function, maybe a coroutine function, that gets a `ServerGoalHandle` and
            returns the result.
        callback_group: Group of the callbacks; that of the node when not given.
        goal_callback: Function that gets a goal message, and returns a `GoalResponse`.
        handle_accepted_callback: Function that gets the handle of an accepted goal; by default it
            is executed.
        cancel_callback: Function that gets the handle of a goal to cancel, and returns a
            `CancelResponse`; by default no goal is cancelled.
        result_timeout: Seconds for which results are kept.
        options: Profiles of quality of service, which are ignored.
    """

    def __init__(
        self,
        node: Any,
        action_type: type[Any],
        action_name: str,
        execute_callback: Callable[[Any], Any],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: Callable[[Any], Any] | None = None,
        handle_accepted_callback: Callable[[Any], Any] | None = None,
        cancel_callback: Callable[[Any], Any] | None = None,
        result_timeout: float = 10.0,
        **options: Any,
    ) -> None:
        del options
        self.action_type: type[Any] = action_type
        self.callback_group: CallbackGroup = callback_group or node.default_callback_group
        self._node = node
        self._jobs: deque[Callable[[], Any]] = deque()
        self._handles: dict[uuid.UUID, ServerGoalHandle] = {}
        self.register_execute_callback(execute_callback)
        self.register_goal_callback(goal_callback)
        self.register_handle_accepted_callback(handle_accepted_callback)
        self.register_cancel_callback(cancel_callback)
        self._server: actions.ActionServer = node.rosz_node.action_server(
            action_name,
            action_type,
            self._run,
            goal=self._ask_goal,
            cancel=self._ask_cancel,
            keep_results=result_timeout,
        )
        node.rosz_add(self)

    def register_execute_callback(self, execute_callback: Callable[[Any], Any]) -> None:
        """Set the function that executes goals."""
        if not callable(execute_callback):
            raise UsageError("the execute callback cannot be called; expected a function")
        self._on_execute = execute_callback

    def register_goal_callback(self, goal_callback: Callable[[Any], Any] | None) -> None:
        """Set the function that accepts goals; None to accept all."""
        self._on_goal = goal_callback or (lambda _: GoalResponse.ACCEPT)

    def register_handle_accepted_callback(
        self, handle_accepted_callback: Callable[[Any], Any] | None
    ) -> None:
        """Set the function that gets accepted goals; None to execute them."""
        self._on_accepted = handle_accepted_callback or (lambda handle: handle.execute())

    def register_cancel_callback(self, cancel_callback: Callable[[Any], Any] | None) -> None:
        """Set the function that allows cancellations; None to allow none."""
        self._on_cancel = cancel_callback or (lambda _: CancelResponse.REJECT)

    # Called on threads of the native server, which wait for the executor.

    def _ask_goal(self, request: Any) -> bool:
        return self._ask(self._on_goal, request) is GoalResponse.ACCEPT

    def _ask_cancel(self, goal: ServerGoal) -> bool:
        # The thread that executes the goal may not have begun.
        handle = self._handles.get(goal.id) or ServerGoalHandle(self, goal)
        return self._ask(self._on_cancel, handle) is CancelResponse.ACCEPT

    def _ask(self, callback: Callable[[Any], Any], value: Any) -> Any:
        """Let the executor call a callback, and return its answer."""
        answers: list[Any] = []
        finished = threading.Event()

        async def call() -> None:
            try:
                answers.append(await completed(callback(value)))
            finally:
                finished.set()

        self._submit(call)
        self._wait(finished)
        return answers[0] if answers else None

    def _run(self, goal: ServerGoal) -> None:
        handle = self._handles[goal.id] = ServerGoalHandle(self, goal)
        try:
            self._submit(lambda: self._on_accepted(handle))
            self._wait(handle.finished)
        finally:
            del self._handles[goal.id]

    def _wait(self, event: threading.Event) -> None:
        while not event.wait(_CHECK_PERIOD):
            if self._node.rosz_node.is_shutdown:
                return

    def _submit(self, job: Callable[[], Any]) -> None:
        self._jobs.append(job)
        self._node.rosz_wake()

    def execute(self, handle: ServerGoalHandle, callback: Callable[[Any], Any] | None) -> None:
        """Let the executor execute a goal; see `ServerGoalHandle.execute`."""
        execute = callback or self._on_execute

        async def call() -> None:
            result: Any = None
            try:
                result = await completed(execute(handle))
            except Exception as error:  # noqa: BLE001  # the callback boundary, as in rclpy
                self._node.rosz_node.log.report("the execute callback of an action failed", error)
            finally:
                self._finish(handle, result)

        self._submit(call)

    def _finish(self, handle: ServerGoalHandle, result: Any) -> None:
        log = self._node.rosz_node.log
        if handle.is_active:
            log.warning("the state of the goal is not set: it is aborted")
        if not isinstance(result, self.action_type.Result):
            if result is not None:
                expected = self.action_type.Result.__name__
                log.error("got a result of %s, expected %s", type(result).__name__, expected)
            result = None
        try:
            handle.finish(result)
        finally:
            handle.finished.set()

    def take(self) -> Callable[[], Any] | None:
        """Return the next function for the executor; None if there is none."""
        try:
            return self._jobs.popleft()
        except IndexError:
            return None

    def destroy(self) -> None:
        """Close the server."""
        self._node.rosz_remove(self)
        self._server.close()


class ClientGoalHandle:
    """The answer of a server to a goal, and the goal if it was accepted."""

    def __init__(self, client: ActionClient, goal_id: uuid.UUID, goal: ClientGoal | None) -> None:
        self._client = client
        self._goal = goal
        self.goal_id: UUID = UUID(goal_id.bytes)
        self.accepted: bool = goal is not None
        self.stamp: Time = Time.from_nsec(goal.accepted) if goal is not None else Time()

    @property
    def status(self) -> int:
        """The last known state of the goal, a constant of ``GoalStatus``."""
        return int(self._goal.status) if self._goal is not None else GoalStatus.STATUS_UNKNOWN

    def get_result_async(self) -> Future:
        """Return a future of the response with the status and the result."""
        goal = self._followed()
        return self._client.in_background(lambda: self._client.result_of(goal))

    def get_result(self) -> Any:
        """Wait for the response with the status and the result."""
        return self._client.result_of(self._followed())

    def cancel_goal_async(self) -> Future:
        """Return a future of the response to a request to cancel the goal."""
        return self._client.in_background(self.cancel_goal)

    def cancel_goal(self) -> Any:
        """Ask the server to cancel the goal, and return its response."""
        return self._client.native.request_cancel(GoalInfo(self.goal_id), _LONGEST_WAIT)

    def _followed(self) -> ClientGoal:
        if self._goal is None:
            raise UsageError("the goal was not accepted, so it has no result")
        return self._goal


class ActionClient:
    """Send goals to an action.

    Args:
        node: Node of rclpy.
        action_type: Class of the action.
        action_name: Name of the action.
        options: A callback group and profiles of quality of service, which are ignored.

    Attributes:
        native: The client of rosz.
    """

    def __init__(self, node: Any, action_type: type[Any], action_name: str, **options: Any) -> None:
        del options
        self._node = node
        self._action_type = action_type
        self.native: actions.ActionClient = node.rosz_node.action_client(action_name, action_type)
        node.rosz_add(self)

    def server_is_ready(self) -> bool:
        """Return whether a node serves the action."""
        return self.native.is_served()

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait until a node serves the action; return whether one does.

        Args:
            timeout_sec: Time limit in seconds; none when not given.
        """
        try:
            self.native.wait_for_server(_LONGEST_WAIT if timeout_sec is None else timeout_sec)
        except WaitTimeout:
            return False
        return True

    def send_goal_async(
        self,
        goal: Any,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: UUID | None = None,
    ) -> Future:
        """Return a future of the `ClientGoalHandle` of a goal; it waits for a server.

        Args:
            goal: The goal message.
            feedback_callback: Function called by the executor with each feedback message.
            goal_uuid: Identification of the goal; a random one when not given.

        Raises:
            UsageError: It is not a goal message of the action.
        """
        self._check(goal)

        def send() -> ClientGoalHandle:
            self.native.wait_for_server(_LONGEST_WAIT)
            return self._send(goal, feedback_callback, goal_uuid)

        return self.in_background(send)

    def send_goal(
        self,
        goal: Any,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: UUID | None = None,
    ) -> Any:
        """Send a goal, and wait for the response with its status and result.

        A callback must not do so if the server is spun by the same executor.

        Returns:
            The response; None if the goal was rejected.
        """
        self._check(goal)
        handle = self._send(goal, feedback_callback, goal_uuid)
        return handle.get_result() if handle.accepted else None

    def _check(self, goal: Any) -> None:
        if not isinstance(goal, self._action_type.Goal):
            expected = self._action_type.Goal.__name__
            raise UsageError(f"got a goal of {type(goal).__name__}, expected {expected}")

    def _send(
        self, goal: Any, callback: Callable[[Any], Any] | None, goal_uuid: UUID | None
    ) -> ClientGoalHandle:
        goal_id = uuid.UUID(bytes=bytes(goal_uuid.uuid)) if goal_uuid else uuid.uuid4()

        def receive(feedback: Any) -> None:
            message = self._action_type.FeedbackMessage(UUID(goal_id.bytes), feedback)
            if callback is not None:
                self._node.rosz_call_soon(lambda: callback(message))

        try:
            sent = self.native.send(goal, feedback=receive, timeout=_LONGEST_WAIT, goal_id=goal_id)
        except GoalRejected:
            return ClientGoalHandle(self, goal_id, None)
        return ClientGoalHandle(self, goal_id, sent)

    def result_of(self, goal: ClientGoal) -> Any:
        """Wait for a goal, and return the response with its status and result."""
        try:
            result = goal.result()
        except GoalFailed as error:
            result = error.result
        return self._action_type.GetResult.Response(int(goal.status), result)

    def in_background(self, function: Callable[[], Any]) -> Future:
        """Return a future of the result of a function that waits."""
        return in_background(f"rosz-call{self.native.name}", function, self._node.rosz_call_soon)

    def destroy(self) -> None:
        """Close the client."""
        self._node.rosz_remove(self)
        self.native.close()


def get_action_names_and_types(node: Any) -> list[tuple[str, list[str]]]:
    """Return the actions that are served or used, with their types."""
    view = node.rosz_node.context.graph.view()
    return [(entry.name, list(entry.types)) for entry in actions.list_actions(view)]
