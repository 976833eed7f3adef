"""Goals of actionlib's clients for servers of ROS 2."""

from __future__ import annotations

import uuid
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol
from weakref import WeakKeyDictionary

from rosz.actions.mapping import STATUSES, translate
from rosz.errors import ActionError, ClosedError, GoalFailed, GoalRejected, RoszError
from rosz.msgs.action_msgs.msg import GoalInfo
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.node.action_client import ActionClient as NativeClient
from rosz.node.goals import SEND
from rosz.session import LONGEST_WAIT
from rosz.wire import Kind
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.actions.types import ActionTypes
    from rosz.message import Action
    from rosz.node import Node
    from rosz.node.action_client import ClientGoal as NativeGoal

__all__ = ("FollowedGoal", "Ros2Client")

_CANCEL_TIMEOUT = 10.0
_KNOWN_TIMEOUT = 2.0


class FollowedGoal(Protocol):
    """A goal that a client of actionlib follows."""

    id: GoalID

    def advance(self, status: GoalStatus, /) -> None:
        """Note a state that is not the end of the goal."""

    def receive_feedback(self, feedback: Any, /) -> None:
        """Take feedback."""

    def finish(self, status: GoalStatus, result: Any, /) -> None:
        """Note the end of the goal."""


class Ros2Client:
    """Sends goals by the protocol of ROS 2, and follows them.

    Its calls wait for the server, one after the other on a thread, so that a cancellation comes
    after its goal. It declares nothing before the first goal.

    Args:
        node: Node that the client belongs to.
        name: Full name of the action.
        types: Message classes of the action.
        action: Class of the action.
    """

    def __init__(self, node: Node, name: str, types: ActionTypes, action: type[Action]) -> None:
        self._node = node
        self._name = name
        self._types = types
        self._action = action
        self._ids: WeakKeyDictionary[FollowedGoal, uuid.UUID] = WeakKeyDictionary()
        self._calls: Worker[Any] = node.keep(Worker(f"rosz-action{name}"))
        self._client: NativeClient | None = None
        graph = node.context.graph
        self._servers = node.keep(graph.follow_entities(Kind.SERVICE, f"{name}/{SEND}"))
        self._topics = node.keep(graph.follow_entities(Kind.PUBLISHER, f"{name}/status"))

    def is_served(self, *, wait: bool = False) -> bool:
        """Return whether a node serves the action by this protocol only.

        Args:
            wait: Whether to wait, for a short time, until the servers are known that exist.
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
        """Send a goal.

        Args:
            goal: The goal to update.
            message: The goal message.

        Raises:
            EncodeError: A field of the message has a value that does not fit.
        """
        native = translate(message, self._action.Goal)
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

        Args:
            goal_id: Time until which the goals were accepted; empty for all goals.
        """
        own = next((goal for goal in list(self._ids) if goal.id.id == goal_id.id), None)
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

    def _connect(self) -> NativeClient:
        """Return the client; called on the thread for calls."""
        if self._client is None:
            self._client = self._node.action_client(self._name, self._action)
        return self._client

    def _send(self, goal: FollowedGoal, message: Any) -> None:
        feedback_type = self._types.feedback
        try:
            sent = self._connect().send(
                message,
                feedback=lambda feedback: goal.receive_feedback(translate(feedback, feedback_type)),
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

    def _finish(self, goal: FollowedGoal, native: NativeGoal) -> None:
        try:
            result = native.result()
        except ClosedError:
            return
        except GoalFailed as error:
            result = error.result
        except ActionError as error:
            self._lose(goal, error)
            return
        goal.finish(_status(goal, native), translate(result, self._types.result))

    def _lose(self, goal: FollowedGoal, error: RoszError) -> None:
        goal.finish(GoalStatus(goal.id, GoalStatus.LOST, str(error)), None)

    def _cancel(self, info: GoalInfo) -> None:
        try:
            self._connect().request_cancel(info, _CANCEL_TIMEOUT)
        except ClosedError:
            return
        except RoszError as error:
            self._node.log.warning("cannot cancel a goal: %s", error)


def _status(goal: FollowedGoal, native: NativeGoal) -> GoalStatus:
    return GoalStatus(goal.id, STATUSES[native.status])
