"""Action clients, by the protocol of ROS 2.

The result of a goal is asked for as soon as the goal is accepted, and the server answers when there
is one. So a server that ends is noticed at once: the query ends without an answer. A server that is
out of reach is noticed by `ServerWatch`, and its goals are followed again when it is back.
"""

from __future__ import annotations

import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, Self
from weakref import WeakValueDictionary

from rosz.errors import (
    ActionError,
    ClosedError,
    GoalFailed,
    GoalRejected,
    RoszError,
    ServerSilent,
    ServiceError,
    ServiceNotFound,
    WaitTimeout,
)
from rosz.graph import View
from rosz.lifecycle import Lifecycle
from rosz.message import Action
from rosz.msgs.action_msgs.msg import GoalInfo, GoalStatusArray
from rosz.msgs.action_msgs.srv import CancelGoal, CancelGoalResponse
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.node.actions.states import CANCEL, FEEDBACK, FINAL, RESULT, SEND, STATUS, GoalState
from rosz.node.actions.watch import LONGEST_SILENCE, ServerWatch
from rosz.node.client import Client
from rosz.node.core import NodeCore
from rosz.node.subscription import Subscription
from rosz.qos import DEFAULT, LATCHED, SERVICES
from rosz.session import LONGEST_WAIT, clamp_timeout
from rosz.worker import start_thread

_MOST_FEEDBACK = 1000
"""Messages of feedback that wait to be iterated over; older ones are dropped."""


class ClientGoal:
    """A goal that was sent; see `ActionClient.send`.

    Iterate over it to get its feedback until it ends. As a context manager it cancels the goal if
    that has not ended.

    Attributes:
        id: Identification of the goal.
        accepted: Time at which the server accepted it, in nanoseconds of the server's clock.
    """

    def __init__(
        self,
        client: ActionClient,
        goal_id: uuid.UUID,
        feedback: Callable[[Any], object] | None,
        on_status: Callable[[ClientGoal], object] | None,
    ) -> None:
        self.id: uuid.UUID = goal_id
        self.accepted: int = 0
        self._client = client
        self._on_feedback = feedback
        self._on_status = on_status
        self._notifying = threading.RLock()
        self._notified = GoalState.UNKNOWN
        self._state = GoalState.UNKNOWN
        self._feedback: deque[Any] = deque(maxlen=_MOST_FEEDBACK)
        self._changed = threading.Condition()
        self._result: Any = None
        self._error: RoszError | None = None
        self._ended = False
        self._on_done: list[Callable[[ClientGoal], object]] = []

    @property
    def status(self) -> GoalState:
        """The last known state of the goal."""
        return self._state

    @property
    def done(self) -> bool:
        """Whether the goal has ended, or its server has."""
        return self._ended

    def wait(self, timeout: float | None = None, *, silence: float | None = None) -> GoalState:
        """Wait until the goal has ended.

        Args:
            timeout: Time limit in seconds; none when not given.
            silence: Seconds for which the server may be out of reach, at least 2; 60 when not
                given.

        Returns:
            The final state.

        Raises:
            WaitTimeout: It has not ended in time.
            ServerSilent: The server does not answer; the goal is followed still.
            ActionError: The server ended first, or does not know the goal any more.
            ClosedError: The client was closed meanwhile.
            UsageError: The timeout is not a number.
        """
        limit = LONGEST_WAIT if timeout is None else clamp_timeout(timeout)
        longest = LONGEST_WAIT if silence is None else clamp_timeout(silence)
        deadline = time.monotonic() + limit
        with self._changed:
            while not self._ended:
                silent = self._client.silence
                if silent and silent >= longest:
                    raise ServerSilent(self._client.name, silent)
                left = deadline - time.monotonic()
                if left <= 0:
                    raise WaitTimeout(f"result of action '{self._client.name}'", limit, self._hint)
                self._changed.wait(min(left, longest - silent) if silent else left)
        if self._error is not None:
            raise self._error
        return self._state

    @property
    def _hint(self) -> str:
        silent = self._client.silence
        unheard = f", and the server has not answered for {silent:.1f} s" if silent else ""
        return f"it is {self._state.text}{unheard}"

    def result(self, timeout: float | None = None, *, silence: float | None = None) -> Any:
        """Wait for the result of the goal.

        Arguments and other errors are those of `wait`.

        Returns:
            The result of a goal that succeeded.

        Raises:
            GoalFailed: The goal was aborted or canceled; the error has the result.
        """
        state = self.wait(timeout, silence=silence)
        if state is not GoalState.SUCCEEDED:
            text = f"the goal of action '{self._client.name}' was {state.text}"
            raise GoalFailed(text, state, self._result)
        return self._result

    def cancel(self, timeout: float = 10.0) -> bool:
        """Ask the server to end the goal; wait for its end with `wait`.

        Args:
            timeout: Time limit in seconds for the answer of the server.

        Returns:
            Whether the server ends it; not if it refuses, or if the goal has ended before.

        Raises:
            ServiceError: The server ended, or nobody serves the action any more.
            WaitTimeout: The server did not answer in time.
            ClosedError: The client is closed.
        """
        response = self._client.request_cancel(GoalInfo(UUID(self.id.bytes)), timeout)
        return any(bytes(info.goal_id.uuid) == self.id.bytes for info in response.goals_canceling)

    def on_done(self, callback: Callable[[ClientGoal], object]) -> None:
        """Call a function with this object when the goal has ended, on a thread of the client.

        If it has, the function is called at once.
        """
        with self._changed:
            if not self._ended:
                self._on_done.append(callback)
                return
        self._client.call_back(callback, self)

    def __iter__(self) -> Iterator[Any]:
        """Yield feedback as it comes, until the goal ends; later feedback is left out."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._feedback or self._ended)
                if not self._feedback:
                    return
                feedback = self._feedback.popleft()
            yield feedback

    def update(self, state: GoalState) -> None:
        """Note a state that the server published; for the client."""
        with self._changed:
            if not self._ended and state > self._state and state not in FINAL:
                self._state = state
        if self._on_status is None:
            return
        with self._notifying:  # so that no older state comes after a newer one
            if self._notified < self._state and not self._ended:
                self._notified = self._state
                self._client.call_back(self._on_status, self)

    def receive_feedback(self, feedback: Any) -> None:
        """Take feedback; for the client."""
        if self._on_feedback is not None:
            self._client.call_back(self._on_feedback, feedback)
            return
        with self._changed:
            self._feedback.append(feedback)
            self._changed.notify_all()

    def wake(self) -> None:
        """Let those who wait notice that the server does not answer; for the client."""
        with self._changed:
            self._changed.notify_all()

    def finish(self, state: GoalState, result: Any, error: RoszError | None = None) -> None:
        """Note the end of the goal; for the client."""
        with self._changed:
            if self._ended:
                return
            self._state, self._result, self._error = state, result, error
            self._ended = True
            callbacks, self._on_done = self._on_done, []
            self._changed.notify_all()
        for callback in callbacks:
            self._client.call_back(callback, self)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self._client.abandon([self])

    def __repr__(self) -> str:
        return f"<goal {self.id} of {self._client.name}, {self._state.text}>"


class ActionClient:
    """Send goals to an action; see `rosz.Node.action_client`. Safe for threads and callbacks.

    As a context manager it cancels the goals that have not ended.

    Attributes:
        name: Full name of the action.
        action_type: Class of the action.
    """

    def __init__(self, node: NodeCore, name: str, action_type: type[Action]) -> None:
        self.name: str = name
        self.action_type: type[Action] = action_type
        self._node = node
        self._goals: dict[bytes, ClientGoal] = {}
        # A result may overtake the last feedback, which still goes to those who hold the goal.
        self._remembered: WeakValueDictionary[bytes, ClientGoal] = WeakValueDictionary()
        self._lifecycle = Lifecycle(f"the client of action '{name}'", log=node.log)
        keep = self._lifecycle.keep
        self._watch = keep(
            ServerWatch(name, lambda: self._goals, self._wake_waiters, node.log, queries=True)
        )
        keep(
            Subscription(
                node,
                f"{name}/{FEEDBACK}",
                action_type.FeedbackMessage,
                self._receive_feedback,
                DEFAULT,
            )
        )
        self._status: Subscription[GoalStatusArray] = keep(
            Subscription(node, f"{name}/{STATUS}", GoalStatusArray, self._receive_status, LATCHED)
        )
        kinds = {RESULT: action_type.GetResult, CANCEL: CancelGoal, SEND: action_type.SendGoal}
        limits = {RESULT: LONGEST_WAIT}
        self._clients = {
            part: keep(Client(node, f"{name}/{part}", kind, SERVICES, limits.get(part, 10.0)))
            for part, kind in kinds.items()
        }

    @property
    def goals(self) -> list[ClientGoal]:
        """The goals that have not ended, the oldest first."""
        return list(self._goals.values())

    @property
    def silence(self) -> float:
        """Seconds since the server answered last; 0 if it answers, or has no goal of this client.

        A server that does not answer is noticed within 2 s, and logged as a warning.
        """
        return self._watch.silence

    def wait_for_server(self, timeout: float = 10.0) -> None:
        """Wait until a node serves the action with this type.

        Args:
            timeout: Time limit in seconds.

        Raises:
            WaitTimeout: No node did in time.
            ClosedError: The client is closed, or the context was shut down meanwhile.
            UsageError: The timeout is not a number.
        """
        self._lifecycle.check_open("wait")
        deadline = time.monotonic() + clamp_timeout(timeout)
        what = f"server of action '{self.name}' with type '{self.action_type._type_name}'"
        try:
            for client in self._clients.values():
                client.wait_for_service(max(0.0, deadline - time.monotonic()))
        except WaitTimeout as error:
            raise WaitTimeout(what, timeout) from error

    def is_served(self) -> bool:
        """Return whether a node serves the action with this type."""
        view: View = self._node.context.graph.view()
        return all(
            any(map(client.matches, view.servers(client.name))) for client in self._clients.values()
        )

    def send(
        self,
        goal: Any,
        *,
        feedback: Callable[[Any], object] | None = None,
        on_status: Callable[[ClientGoal], object] | None = None,
        timeout: float = 10.0,
        goal_id: uuid.UUID | None = None,
    ) -> ClientGoal:
        """Send a goal, and wait until the server has accepted it.

        Args:
            goal: The goal message.
            feedback: Function called with each feedback message, on a thread of the client. Without
                one, iterate over the goal that is returned.
            on_status: Function called with the goal when it has another state, before it ends.
            timeout: Time limit in seconds for the answer of the server.
            goal_id: Identification of the goal; a random one when not given.

        Returns:
            The goal, which is followed until it ends.

        Raises:
            GoalRejected: The server did not accept it.
            EncodeError: A field of the goal has a value that does not fit.
            ServiceNotFound: No node serves the action.
            ServiceError: The server failed, or ended.
            WaitTimeout: The server did not answer in time; the goal may be executed.
            ClosedError: The client is closed.
            UsageError: The timeout is not a number.
        """
        self._lifecycle.check_open("send a goal")
        sent = ClientGoal(self, goal_id or uuid.uuid4(), feedback, on_status)
        request = self.action_type.SendGoal.Request(UUID(sent.id.bytes), goal)
        # Before the answer, which feedback may overtake.
        self._goals[sent.id.bytes] = self._remembered[sent.id.bytes] = sent
        accepted = False
        try:
            response = self._call(SEND, request, timeout)
            accepted = response.accepted
        finally:
            if not accepted:
                self._goals.pop(sent.id.bytes, None)
        if not accepted:
            raise GoalRejected(f"the server of action '{self.name}' rejected the goal")
        sent.accepted = response.stamp.to_nsec()
        sent.update(GoalState.ACCEPTED)
        self._watch.begin(self._status)
        name = f"rosz-goal{self.name}"
        start_thread(threading.Thread(target=self._follow, args=(sent,), name=name, daemon=True))
        return sent

    def cancel_all(self, before: int = 0, timeout: float = 10.0) -> int:
        """Ask the server to end goals of all clients.

        Args:
            before: Time in nanoseconds; only goals accepted until then are meant. 0 for all.
            timeout: Time limit in seconds for the answer of the server.

        Returns:
            Number of goals that the server ends.

        Raises:
            ServiceError: The server ended, or nobody serves the action.
            WaitTimeout: The server did not answer in time.
            ClosedError: The client is closed.
        """
        info = GoalInfo(stamp=Time.from_nsec(before))
        return len(self.request_cancel(info, timeout).goals_canceling)

    def request_cancel(self, goal: GoalInfo, timeout: float) -> CancelGoalResponse:
        """Ask the server to end goals, in the terms of the protocol; errors as `cancel_all`.

        Args:
            goal: A goal, a time, or both.
            timeout: Time limit in seconds for the answer of the server.
        """
        response: CancelGoalResponse = self._call(CANCEL, CancelGoal.Request(goal), timeout)
        return response

    def _call(self, part: str, request: Any, timeout: float) -> Any:
        try:
            return self._clients[part].call(request, timeout)
        except ServiceNotFound as error:
            view = self._node.context.graph.view()
            others = view.servers(f"{self.name}/{part}")
            why = f": {error}" if others else "; nobody serves that name"
            raise ServiceNotFound(f"action '{self.name}' is not available{why}") from error

    def _follow(self, goal: ClientGoal) -> None:
        """Wait for the result of a goal, which ends the goal."""
        state, result = GoalState.UNKNOWN, None
        error: RoszError | None = None
        try:
            response = self._request_result(goal)
            state, result = GoalState(response.status), response.result
            if state not in FINAL:
                error = ActionError(
                    f"the server of action '{self.name}' does not know goal {goal.id}: it was"
                    " started anew, or has forgotten the result"
                )
        except ClosedError as fault:
            error = fault
        except (RoszError, ValueError) as fault:
            error = ActionError(f"the result of goal {goal.id} of '{self.name}' is lost: {fault}")
        self._goals.pop(goal.id.bytes, None)
        goal.finish(state, result, error)

    def _request_result(self, goal: ClientGoal) -> Any:
        """Wait for the result; a server that was out of reach is asked again when it is back."""
        request = self.action_type.GetResult.Request(UUID(goal.id.bytes))
        client = self._clients[RESULT]
        while True:
            try:
                return client.call(request, LONGEST_WAIT)
            except ServiceError:
                silence = self._watch.silence
                if not 0 < silence < LONGEST_SILENCE:
                    raise
                # Not at once: Zenoh never ends a query that comes while it gives a link up.
                back = self._watch.wait_for_answer()
                try:
                    client.wait_for_service(LONGEST_SILENCE - silence if back else 0.0)
                except WaitTimeout as error:
                    text = f"the server has been out of reach for {LONGEST_SILENCE:g} s"
                    raise ServiceError(text) from error

    def _wake_waiters(self) -> None:
        for goal in self.goals:
            goal.wake()

    def _receive_feedback(self, message: Any) -> None:
        self._watch.note_answer()
        goal = self._remembered.get(bytes(message.goal_id.uuid))
        if goal is not None:
            goal.receive_feedback(message.feedback)

    def _receive_status(self, message: GoalStatusArray) -> None:
        self._watch.note_answer()
        for status in message.status_list:
            goal = self._goals.get(bytes(status.goal_info.goal_id.uuid))
            if goal is not None and status.status in tuple(GoalState):
                goal.update(GoalState(status.status))

    def call_back(self, callback: Callable[[Any], object], value: Any) -> None:
        """Call a function of the program, and log its failure; for a goal."""
        try:
            callback(value)
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            self._node.log.report(f"a callback of action '{self.name}' failed", error)

    def abandon(self, goals: list[ClientGoal]) -> None:
        """Ask the server to end goals that have not ended; failures are logged."""
        for goal in goals:
            if goal.done or self._lifecycle.closing:
                continue
            try:
                goal.cancel()
            except RoszError as error:
                self._node.log.warning("cannot cancel a goal of action '%s': %s", self.name, error)

    def close(self) -> None:
        """End the client; goals go on, and are not followed any more."""
        try:
            self._lifecycle.close()
        finally:
            self._node.forget(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        try:
            self.abandon(self.goals)
        finally:
            self.close()

    def __repr__(self) -> str:
        state = " closed" if self._lifecycle.closing else ""
        return f"<ActionClient {self.name} [{self.action_type._type_name}]{state}>"
