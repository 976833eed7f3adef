"""Translation between actionlib's protocol for actions and that of ROS 2, in both directions."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, TypeVar
from weakref import WeakKeyDictionary

from rosz.errors import ActionError, ClosedError, GoalFailed, GoalRejected, RoszError
from rosz.message import Action, Message
from rosz.msgs.action_msgs.msg import GoalInfo
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.node.actions import (
    FINAL,
    SEND,
    TO_ACTIONLIB,
    TO_ROS2,
    GoalServer,
    GoalState,
    ServerOptions,
)
from rosz.session import LONGEST_WAIT
from rosz.wire import Kind
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.actions.types import ActionTypes
    from rosz.node import Node
    from rosz.node.actions import ActionClient, ClientGoal, ServerGoal

M = TypeVar("M", bound=Message)
_CANCEL_TIMEOUT = 10.0
_KNOWN_TIMEOUT = 2.0
"""Seconds to wait for the tokens of existing servers: a goal goes by one protocol only."""


class FollowedGoal(Protocol):
    """A goal that a client of actionlib follows."""

    id: GoalID

    def advance(self, status: GoalStatus, /) -> None:
        """Note a state that is not the end of the goal."""

    def receive_feedback(self, feedback: Any, /) -> None:
        """Take feedback."""

    def finish(self, status: GoalStatus, result: Any, /) -> None:
        """Note the end of the goal."""


class ActionlibToRos2:
    """Sends goals by the protocol of ROS 2, and follows them.

    Its calls wait for the server, one after the other on a thread, so that a cancellation comes
    after its goal. It declares nothing before the first goal.
    """

    def __init__(self, node: Node, name: str, types: ActionTypes, action: type[Action]) -> None:
        self._node = node
        self._name = name
        self._types = types
        self._action = action
        self._ids: WeakKeyDictionary[FollowedGoal, uuid.UUID] = WeakKeyDictionary()
        self._calls: Worker[Any] = node.keep(Worker(f"rosz-action{name}"))
        self._client: ActionClient | None = None
        graph = node.context.graph
        self._servers = node.keep(graph.follow_entities(Kind.SERVICE, f"{name}/{SEND}"))
        self._topics = node.keep(graph.follow_entities(Kind.PUBLISHER, f"{name}/status"))

    def is_served(self, *, wait: bool = False) -> bool:
        """Return whether a node serves the action by this protocol only.

        ``wait`` waits, for a short time, until the servers are known that exist.
        """
        for followed in (self._topics, self._servers):
            if wait and not followed.complete:
                with suppress(ClosedError):  # nothing is sent then
                    followed.wait_for(lambda _: True, _KNOWN_TIMEOUT, "servers of an action")
        kind = self._action.SendGoal
        return not self._topics.view().publishers(f"{self._name}/status") and any(
            (token.type_name, token.type_hash) == (kind._type_name, kind._type_hash)
            for token in self._servers.view().servers(f"{self._name}/{SEND}")
        )

    def send(self, goal: FollowedGoal, message: Any) -> None:
        """Send a goal, and update it from then on; raise EncodeError if a value does not fit."""
        native = _translate(message, self._action.Goal)
        native.to_cdr()
        self._ids[goal] = uuid.uuid4()
        self._calls.submit(partial(self._send, goal, native))

    def has_sent(self, goal: FollowedGoal) -> bool:
        """Return whether a goal was sent by this client."""
        return goal in self._ids

    def cancel(self, goal: FollowedGoal) -> None:
        """Ask the server to cancel a goal that was sent."""
        self._calls.submit(partial(self._cancel, GoalInfo(UUID(self._ids[goal].bytes))))

    def cancel_all(self, goal_id: GoalID) -> None:
        """Ask the server to cancel goals, also those of other clients.

        They are those accepted until the time of the ID, or all if it is empty.
        """
        goals = (reference() for reference in self._ids.keyrefs())  # others may send meanwhile
        own = next((goal for goal in goals if goal and goal.id.id == goal_id.id), None)
        if own is not None:
            self.cancel(own)
        elif not goal_id.id:
            self._calls.submit(partial(self._cancel, GoalInfo(stamp=goal_id.stamp)))

    def close(self) -> None:
        """Follow no goals any more."""
        for part in (self._servers, self._topics, self._client, self._calls):
            if part is not None:
                self._node.forget(part)
                part.close()

    def _connect(self) -> ActionClient:
        """Return the client; called on the thread for calls."""
        if self._client is None:
            self._client = self._node.action_client(self._name, self._action)
        return self._client

    def _send(self, goal: FollowedGoal, message: Any) -> None:
        def receive(feedback: Any) -> None:
            goal.receive_feedback(_translate(feedback, self._types.feedback))

        try:
            sent = self._connect().send(
                message,
                feedback=receive,
                on_status=lambda native: goal.advance(_status(goal, native)),
                timeout=LONGEST_WAIT,
                goal_id=self._ids[goal],
            )
        except ClosedError:
            return
        except GoalRejected as error:
            goal.finish(GoalStatus(goal.id, GoalStatus.REJECTED, str(error)), self._types.result())
        except RoszError as error:
            self._lose(goal, error)
        else:
            sent.on_done(partial(self._finish, goal))

    def _finish(self, goal: FollowedGoal, native: ClientGoal) -> None:
        try:
            result = native.result()
        except ClosedError:
            return
        except GoalFailed as error:
            result = error.result
        except ActionError as error:
            self._lose(goal, error)
            return
        goal.finish(_status(goal, native), _translate(result, self._types.result))

    def _lose(self, goal: FollowedGoal, error: RoszError) -> None:
        goal.finish(GoalStatus(goal.id, GoalStatus.LOST, str(error)), None)

    def _cancel(self, info: GoalInfo) -> None:
        try:
            self._connect().request_cancel(info, _CANCEL_TIMEOUT)
        except ClosedError:
            return
        except RoszError as error:
            self._node.log.warning("cannot cancel a goal: %s", error)


def _status(goal: FollowedGoal, native: ClientGoal) -> GoalStatus:
    return GoalStatus(goal.id, TO_ACTIONLIB[native.status])


class Ros2ToActionlib(GoalServer):
    """Hands goals of ROS 2's clients to a server of actionlib, and publishes their states.

    Args:
        remote: Whether the server is in another node: then a goal is accepted before the server
            gets it. Otherwise a goal that `receive_goal` rejects is not accepted.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        action: type[Action],
        receive_goal: Callable[[Any], object],
        receive_cancel: Callable[[GoalID], object],
        *,
        remote: bool = False,
    ) -> None:
        self._types = types
        self._remote = remote
        self._receive_goal = receive_goal
        self._receive_cancel = receive_cancel
        self._mirrored: dict[str, ServerGoal] = {}
        super().__init__(node, name, action, ServerOptions())
        self._serve()

    def accepts(self, goal: ServerGoal) -> bool:
        """Return whether the server has not rejected a goal at once."""
        if not self._remote:
            self._hand_over(goal)
        return self._remote or str(goal.id) in self._mirrored or goal.done

    def start(self, goal: ServerGoal) -> None:
        """Leave a goal to the server in another node that has begun with it."""
        if self._remote:
            self._hand_over(goal)

    def _hand_over(self, goal: ServerGoal) -> None:
        name, types, stamp = str(goal.id), self._types, Time.from_nsec(goal.accepted)
        self._mirrored[name] = goal
        request = _translate(goal.request, types.goal)
        self._receive_goal(types.action_goal(Header(stamp=stamp), GoalID(stamp, name), request))

    def choose_cancelled(self, goals: list[ServerGoal], all_until: int | None) -> list[ServerGoal]:
        """Tell the server to cancel goals, also those of clients that speak actionlib."""
        if all_until is not None:
            self._receive_cancel(GoalID(stamp=Time.from_nsec(all_until)))
        for goal in goals:
            self._receive_cancel(GoalID(id=str(goal.id)))
        return goals

    def update(self, status: GoalStatus, result: Any) -> None:
        """Let the client of a goal know of its state, and of its result if it has ended."""
        goal = self._mirrored.get(status.goal_id.id)
        if goal is None:
            return
        state = TO_ROS2[status.status]
        if state in FINAL:
            del self._mirrored[status.goal_id.id]
        if status.status == GoalStatus.REJECTED and goal not in self.goals:
            return  # it is not accepted
        if state in {GoalState.CANCELING, GoalState.CANCELED}:
            self.begin_cancel(goal)
        elif goal.status is GoalState.ACCEPTED:
            self.begin(goal)
        if state in FINAL:
            outcome = None if result is None else _translate(result, self.action_type.Result)
            self.end(goal, state, outcome)

    def send_feedback(self, name: str, feedback: Any) -> None:
        """Publish feedback about a goal of a client of ROS 2."""
        goal = self._mirrored.get(name)
        if goal is not None:
            self.publish_feedback(goal, _translate(feedback, self.action_type.Feedback))


def _translate(message: Message, cls: type[M]) -> M:
    """Return a message of another class of the same fields."""
    return cls(**{name: getattr(message, name) for name in cls.__struct_fields__})
