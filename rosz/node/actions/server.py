"""Action servers, by the protocol of ROS 2.

A goal is registered before the client learns that it was accepted, so that it can be cancelled and
its result asked for at once. Its execution begins after that. Results are kept for clients that ask
late, for a time and up to a number.
"""

from __future__ import annotations

import threading
import time
import uuid
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Any, Literal

import msgspec

from rosz.errors import ClosedError, ServiceError, UsageError
from rosz.lifecycle import Closing, Lifecycle
from rosz.message import Action
from rosz.msgs.action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from rosz.msgs.action_msgs.srv import CancelGoal, CancelGoalResponse
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.node.actions import states
from rosz.node.core import NodeCore
from rosz.node.publisher import Publisher
from rosz.node.service import Call, CallService
from rosz.qos import DEFAULT, LATCHED, SERVICES
from rosz.worker import Worker

Policy = Literal["parallel", "queue", "preempt"]
"""Treatment of a goal that arrives while another one is executed: see `rosz.Node`."""

_POLICIES = ("parallel", "queue", "preempt")
_MOST_AT_ONCE = 128
"""Goals executed at one time; each has a thread, so clients could start any number."""
_THREADS = 16
_NO_GOAL = bytes(16)


class ServerGoal:
    """A goal that a server has accepted.

    Attributes:
        id: Identification of the goal, which its client chose.
        request: The goal message.
        accepted: Time at which it was accepted, in nanoseconds.
    """

    def __init__(self, server: GoalServer, goal_id: bytes, request: Any, accepted: int) -> None:
        self.id: uuid.UUID = uuid.UUID(bytes=goal_id)
        self.request: Any = request
        self.accepted: int = accepted
        self._server = server
        self._state = states.GoalState.ACCEPTED
        self._cancelled = threading.Event()
        self._waiting: list[Call] = []
        self._response: bytes | None = None
        self.expires: float = 0.0

    @property
    def status(self) -> states.GoalState:
        """The state of the goal."""
        return self._state

    @property
    def done(self) -> bool:
        """Whether the goal has ended."""
        return self._state in states.FINAL

    @property
    def cancel_requested(self) -> bool:
        """Whether to end: a client or a newer goal asks for it, or the server closes."""
        return self._cancelled.is_set()

    def wait_for_cancel(self, seconds: float) -> bool:
        """Wait until the goal is to end; return whether it is.

        Args:
            seconds: Time limit in seconds.
        """
        return self._cancelled.wait(seconds)

    def feedback(self, feedback: Any) -> None:
        """Publish feedback; after the end of the server do nothing.

        Raises:
            EncodeError: A value does not fit its field.
        """
        self._server.publish_feedback(self, feedback)

    def succeed(self, result: Any = None) -> None:
        """End the goal as reached.

        Args:
            result: The result; an empty one when not given.

        Raises:
            EncodeError: A value does not fit its field. The goal has not ended.
            UsageError: The goal has ended before, or is not executed yet.
        """
        self._server.end(self, states.GoalState.SUCCEEDED, result)

    def abort(self, result: Any = None) -> None:
        """End the goal as failed; arguments and errors as those of `succeed`."""
        self._server.end(self, states.GoalState.ABORTED, result)

    def canceled(self, result: Any = None) -> None:
        """End the goal as cancelled; arguments and errors as those of `succeed`.

        A goal that nobody asked to end cannot be ended so.
        """
        self._server.end(self, states.GoalState.CANCELED, result)

    def move(self, state: states.GoalState) -> None:
        """Go to another state; for the server, which holds its lock.

        Raises:
            UsageError: The goal cannot go there.
        """
        if not states.may_become(self._state, state):
            raise UsageError(
                f"goal {self.id} of action '{self._server.name}' is {self._state.text}: it cannot"
                f" become {state.text}"
            )
        self._state = state
        if state is states.GoalState.CANCELING:
            self._cancelled.set()

    def finish(self, response: bytes) -> list[Call]:
        """Keep the response to those who ask for the result, and return those who wait for it."""
        self._response = response
        waiting, self._waiting = self._waiting, []
        return waiting

    def wait_for_result(self, call: Call) -> bytes | None:
        """Return the response; None if the call has to wait until there is one."""
        if self._response is None:
            self._waiting.append(call)
        return self._response

    def interrupt(self) -> list[Call]:
        """Let the execution know that the server ends, and return those who wait."""
        self._cancelled.set()
        waiting, self._waiting = self._waiting, []
        return waiting

    def info(self) -> GoalInfo:
        """Return the identification of the goal in messages."""
        return GoalInfo(UUID(self.id.bytes), Time.from_nsec(self.accepted))

    def __repr__(self) -> str:
        return f"<goal {self.id} of {self._server.name}, {self._state.text}>"


class ServerOptions(msgspec.Struct, frozen=True):
    """The options of `rosz.Node.action_server`."""

    goal: Callable[[Any], bool] | None = None
    cancel: Callable[[ServerGoal], bool] | None = None
    policy: Policy = "parallel"
    keep_results: float = 900.0
    most_results: int = 200


class GoalServer(Closing, ABC):
    """Serve an action by the protocol; a subclass decides about its goals and executes them.

    Attributes:
        name: Full name of the action.
        action_type: Class of the action.
    """

    def __init__(
        self, node: NodeCore, name: str, action_type: type[Action], options: ServerOptions
    ) -> None:
        self.name: str = name
        self.action_type: type[Action] = action_type
        self._node = node
        self._options = options
        self._lock = threading.RLock()
        self._undecided: dict[bytes, list[Call]] = {}
        self._goals: dict[bytes, ServerGoal] = {}
        self._ended: deque[ServerGoal] = deque()
        self._publishing = threading.Lock()
        self._lifecycle = Lifecycle(f"the server of action '{name}'", log=node.log)

    def _serve(self) -> None:
        """Declare the topics and services; goals may arrive before this returns."""
        node, name, keep = self._node, self.name, self._lifecycle.keep
        feedback = self.action_type.FeedbackMessage
        self._feedback = keep(Publisher(node, f"{name}/{states.FEEDBACK}", feedback, DEFAULT))
        self._status = keep(Publisher(node, f"{name}/{states.STATUS}", GoalStatusArray, LATCHED))
        kinds: dict[str, tuple[Any, Callable[[Call], None]]] = {
            states.RESULT: (self.action_type.GetResult, self._get_result),
            states.CANCEL: (CancelGoal, self._cancel_goals),
            states.SEND: (self.action_type.SendGoal, self._receive),
        }
        for part, (kind, handle) in kinds.items():
            keep(CallService(node, f"{name}/{part}", kind, handle, SERVICES, _THREADS))
        self._publish_status()

    @property
    def goals(self) -> list[ServerGoal]:
        """The goals that have not ended, the oldest first."""
        with self._lock:
            return [goal for goal in self._goals.values() if not goal.done]

    # Requests of clients.

    def _receive(self, call: Call) -> None:
        goal_id = bytes(call.request.goal_id.uuid)
        with self._lock:
            earlier = self._goals.get(goal_id)
            calls = [] if earlier else self._undecided.setdefault(goal_id, [])
            calls.append(call)
            if len(calls) > 1:  # sent twice: it is executed once
                return
        goal = earlier or ServerGoal(self, goal_id, call.request.goal, self._node.clock.now())
        accepted = goal is earlier or (not self._lifecycle.closing and self.accepts(goal))
        with self._lock:
            if goal is not earlier:
                del self._undecided[goal_id]
            if accepted:
                self._goals[goal_id] = goal
        stamp = Time.from_nsec(goal.accepted) if accepted else Time()
        for waiting in calls:
            waiting.answer(self.action_type.SendGoal.Response(accepted, stamp).to_cdr())
        if accepted and goal is not earlier:
            self._publish_status()
            self.start(goal)

    @abstractmethod
    def accepts(self, goal: ServerGoal) -> bool:
        """Return whether to accept a goal."""

    @abstractmethod
    def start(self, goal: ServerGoal) -> None:
        """Begin to execute a goal that was accepted."""

    @abstractmethod
    def choose_cancelled(self, goals: list[ServerGoal], all_until: int | None) -> list[ServerGoal]:
        """Return the goals to end, of those that a client asks to end.

        Args:
            goals: The goals.
            all_until: None if the client names a goal; otherwise it means all goals that were sent
                until this time in nanoseconds, or 0 for any time, also by another protocol.
        """

    def _cancel_goals(self, call: Call) -> None:
        info = call.request.goal_info
        goal_id, stamp = bytes(info.goal_id.uuid), info.stamp.to_nsec()
        response = CancelGoalResponse()
        self._expire()
        with self._lock:
            named = self._goals.get(goal_id)
            everything = goal_id == _NO_GOAL and not stamp
            wanted = [
                goal
                for goal in self._goals.values()
                if not goal.done and (everything or goal is named or 0 < goal.accepted <= stamp)
            ]
        allowed = self.choose_cancelled(wanted, stamp if goal_id == _NO_GOAL else None)
        cancelled = [goal for goal in allowed if self.begin_cancel(goal)]
        if wanted and not cancelled:
            response.return_code = response.ERROR_REJECTED
        elif not cancelled and goal_id != _NO_GOAL:
            ended = named is not None
            response.return_code = (
                response.ERROR_GOAL_TERMINATED if ended else response.ERROR_UNKNOWN_GOAL_ID
            )
        response.goals_canceling = [goal.info() for goal in cancelled]
        call.answer(response.to_cdr())

    def begin_cancel(self, goal: ServerGoal) -> bool:
        """Ask a goal to end; return whether it does, and has not ended otherwise."""
        with self._lock:
            if goal.done:
                return goal.status is states.GoalState.CANCELED
            waits = goal.status is states.GoalState.ACCEPTED and self._options.policy != "parallel"
            if goal.status is not states.GoalState.CANCELING:
                goal.move(states.GoalState.CANCELING)
        if waits:  # its turn would come too late
            self.end(goal, states.GoalState.CANCELED, None)
        else:
            self._publish_status()
        return True

    def _get_result(self, call: Call) -> None:
        self._expire()
        goal = self._goals.get(bytes(call.request.goal_id.uuid))
        if goal is None:
            call.answer(self._response(states.GoalState.UNKNOWN, None))
            return
        with self._lock:
            if self._lifecycle.closing:
                raise ServiceError(self._ending)
            response = goal.wait_for_result(call)
        if response is not None:
            call.answer(response)

    # Changes of goals.

    def begin(self, goal: ServerGoal) -> None:
        """Note that a goal is executed.

        Raises:
            UsageError: It is executed already, or has ended.
        """
        with self._lock:
            goal.move(states.GoalState.EXECUTING)
        self._publish_status()

    def publish_feedback(self, goal: ServerGoal, feedback: Any) -> None:
        """Publish feedback about a goal; see `ServerGoal.feedback`."""
        message = self.action_type.FeedbackMessage(UUID(goal.id.bytes), feedback)
        self._publish(self._feedback, message)

    def end(self, goal: ServerGoal, state: states.GoalState, result: Any) -> None:
        """End a goal; see `ServerGoal.succeed`."""
        response = self._response(state, result)
        with self._lock:
            goal.move(state)
            waiting = goal.finish(response)
            goal.expires = time.monotonic() + self._options.keep_results
            self._ended.append(goal)
            self._expire()
        for call in waiting:
            call.answer(response)
        self._publish_status()

    def _response(self, state: states.GoalState, result: Any) -> bytes:
        outcome = self.action_type.Result() if result is None else result
        return self.action_type.GetResult.Response(int(state), outcome).to_cdr()

    def _expire(self) -> None:
        """Forget goals whose results nobody has asked for in time."""
        with self._lock:
            now, ended = time.monotonic(), self._ended
            while ended and (len(ended) > self._options.most_results or ended[0].expires <= now):
                self._goals.pop(ended.popleft().id.bytes, None)

    def _publish_status(self) -> None:
        with self._publishing:  # so that no older status comes after a newer one
            with self._lock:
                statuses = [
                    GoalStatus(goal.info(), int(goal.status)) for goal in self._goals.values()
                ]
            self._publish(self._status, GoalStatusArray(statuses))

    def _publish(self, publisher: Publisher[Any], message: Any) -> None:
        try:
            publisher.publish(message)
        except ClosedError:
            if not (self._lifecycle.closing or publisher.closed):
                raise

    @property
    def _ending(self) -> str:
        return f"the server of action '{self.name}' ends"

    def close(self) -> None:
        """End the server: those who wait for results learn it, and executed goals are cancelled."""
        try:
            self._lifecycle.close(self._finish)
        finally:
            self._node.forget(self)

    def _finish(self) -> None:
        with self._lock:
            waiting = [call for goal in self._goals.values() for call in goal.interrupt()]
        for call in waiting:
            call.refuse(self._ending)

    def __repr__(self) -> str:
        state = " closed" if self._lifecycle.closing else ""
        return f"<{type(self).__name__} {self.name} [{self.action_type._type_name}]{state}>"


class ActionServer(GoalServer):
    """Serve an action with a function that executes goals; see `rosz.Node.action_server`."""

    def __init__(
        self,
        node: NodeCore,
        name: str,
        action_type: type[Action],
        execute: Callable[[ServerGoal], object],
        options: ServerOptions,
    ) -> None:
        policy = options.policy
        if policy not in _POLICIES:
            raise UsageError(f"policy is {policy!r}: expected 'parallel', 'queue' or 'preempt'")
        super().__init__(node, name, action_type, options)
        self._execute = execute
        limit = _MOST_AT_ONCE if policy == "parallel" else 1
        self._worker: Worker[ServerGoal] = self._lifecycle.keep(
            Worker(f"rosz-action{name}", self._run, threads=limit)
        )
        self._serve()

    def accepts(self, goal: ServerGoal) -> bool:
        """Return whether the program accepts a goal."""
        return self._permits("goal", self._options.goal, goal.request)

    def choose_cancelled(
        self,
        goals: list[ServerGoal],
        all_until: int | None,  # noqa: ARG002  # the other protocol's
    ) -> list[ServerGoal]:
        """Return the goals that the program ends as a client asks."""
        return [goal for goal in goals if self._permits("cancel", self._options.cancel, goal)]

    def _permits(self, what: str, callback: Callable[[Any], bool] | None, value: Any) -> bool:
        if callback is None:
            return True
        try:
            return bool(callback(value))
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            self._node.log.report(f"the {what} callback of action '{self.name}' failed", error)
            return False

    def start(self, goal: ServerGoal) -> None:
        """Execute a goal, and ask the others to end if only the newest one is wanted."""
        if self._options.policy == "preempt":
            for other in self.goals:
                if other is not goal and other.accepted <= goal.accepted:
                    self.begin_cancel(other)
        self._worker.submit(goal)

    def _run(self, goal: ServerGoal) -> None:
        with self._lock:
            if goal.done or self._lifecycle.closing:
                return
            if goal.status is states.GoalState.ACCEPTED:
                goal.move(states.GoalState.EXECUTING)
        self._publish_status()
        log = self._node.log
        try:
            self._execute(goal)
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            if self._lifecycle.closing:
                return
            log.report(f"the execute function of action '{self.name}' failed", error)
        else:
            if goal.done or self._lifecycle.closing:
                return
            log.warning(
                "the execute function of action '%s' returned without ending the goal, which is"
                " aborted; call goal.succeed, goal.abort or goal.canceled",
                self.name,
            )
        if not goal.done:
            self.end(goal, states.GoalState.ABORTED, None)
