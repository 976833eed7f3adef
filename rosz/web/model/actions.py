"""Actions as pages use them: the goals that pages sent, and the states that servers publish.

Servers of ROS 2's protocol and of actionlib's topics look alike here. What has both, as actionlib
of rosz, is used by ROS 2's. Goals belong to the process, not to a page: a page that is opened
again, or in another browser, shows them.
"""

from __future__ import annotations

import threading
import time
import uuid
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Any, Literal, TypeAlias

import msgspec

from rosz.access import PagePolicy
from rosz.actions import (
    FINAL,
    STATUS,
    TERMINAL,
    ActionlibClient,
    ActionlibClientGoal,
    ActionlibState,
    ActionTypes,
    ClientGoal,
    GoalState,
    action_type,
    list_actions,
)
from rosz.errors import ActionError, GoalFailed, NotFoundError, RoszError
from rosz.graph import View
from rosz.lifecycle import SharedResource, Use
from rosz.message import strify_message
from rosz.msgs.action_msgs.msg import GoalInfo
from rosz.msgs.action_msgs.msg import GoalStatusArray as StatusArray
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.names import short_type
from rosz.node import Node
from rosz.qos import LATCHED
from rosz.queue import BoundedQueue
from rosz.web.model.forms import read_form
from rosz.worker import Worker, run_task

_MOST_GOALS = 30
_MOST_FEEDBACK = 20
_MOST_BYTES = 1 << 20
_LONGEST_TEXT = 4000
_TIMEOUT = 10.0
_LATE_SECONDS = 1.0
"""Time for feedback that its result has overtaken."""
_GOAL = "ActionGoal"


class ActionRow(msgspec.Struct, frozen=True):
    """An action that is served.

    Attributes:
        name: Full name.
        type: Its type, as ROS 1 spells it.
        servers: Full names of the nodes that serve it.
        protocol: The protocol that it is used by.
    """

    name: str
    type: str
    servers: tuple[str, ...]
    protocol: Literal["ROS 2", "actionlib"]


class GoalRow(msgspec.Struct, frozen=True):
    """A goal, as its server publishes it.

    Attributes:
        id: Identification of the goal.
        state: State as a word.
        running: Whether it can be canceled.
        stamp: Time at which it was accepted, in nanoseconds.
    """

    id: str
    state: str
    running: bool
    stamp: int


class SentGoal:
    """A goal that a page has sent.

    Args:
        action: Full name of the action.
        text: The goal as YAML.
        on_end: Function called with the goal when it has ended.

    Attributes:
        id: Identification of the goal, once it is sent.
        state: State as a word.
        done: Whether it has ended.
        began: Time at which it was sent, in seconds since 1970.
        result: Result as text; empty while there is none.
        fault: Reason why the goal has no result; empty if there is none.
        feedbacks: Number of messages of feedback.
    """

    def __init__(self, action: str, text: str, on_end: Callable[[SentGoal], object]) -> None:
        self.action: str = action
        self.text: str = text
        self._on_end = on_end
        self.id: str = ""
        self.state: str = "sent"
        self.done: bool = False
        self.began: float = time.time()
        self.result: str = ""
        self.fault: str = ""
        self.feedbacks: int = 0
        self._started = time.monotonic()
        self._ended = 0.0
        self._lock = threading.Lock()
        self._feedback: BoundedQueue[Any] = BoundedQueue(_MOST_FEEDBACK, _MOST_BYTES)

    @property
    def seconds(self) -> float:
        """Seconds that it took, or takes."""
        return (self._ended or time.monotonic()) - self._started

    def add_feedback(self, message: Any) -> None:
        """Take feedback; the newest is kept, within a number of messages and of bytes."""
        size = len(message.to_cdr())
        with self._lock:
            self.feedbacks += 1
            self._feedback.put(message, size)

    def feedback(self) -> list[tuple[int, str]]:
        """Return the newest feedback as text with its numbers, the newest first."""
        with self._lock:
            last, kept = self.feedbacks, list(self._feedback)
        return [(last - place, _text(message)) for place, message in enumerate(reversed(kept))]

    def advance(self, state: str) -> None:
        """Note a state that is not the end."""
        if not self.done:
            self.state = state

    def finish(self, state: str, result: Any, fault: str = "") -> None:
        """Note the end."""
        self._ended = time.monotonic()
        self.result = "" if result is None else _text(result) or "(empty result)"
        self.state, self.fault, self.done = state, fault, True
        self._on_end(self)


def _text(message: Any) -> str:
    text = strify_message(message) if type(message).__slots__ else ""
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]} …"


class ActionPort(ABC):
    """A client of one action, which follows the states that the server publishes.

    Attributes:
        goal_type: Class of the goals.
    """

    def __init__(self, name: str, goal_type: type[Any]) -> None:
        self.goal_type: type[Any] = goal_type
        self._name = name
        self._statuses: list[Any] = []

    def _receive(self, message: Any) -> None:
        self._statuses = message.status_list

    def rows(self) -> list[GoalRow]:
        """Return the goals that the server knows, the newest first."""
        return sorted(map(self._row, self._statuses), key=lambda row: -row.stamp)

    @abstractmethod
    def _row(self, status: Any) -> GoalRow:
        """Return a goal as the page shows it."""

    @abstractmethod
    def send(self, goal: SentGoal, message: Any) -> None:
        """Send a goal, and follow it."""

    @abstractmethod
    def cancel(self, goal_id: str) -> str:
        """Ask the server to end a goal, or all without an identification; return its answer."""

    @abstractmethod
    def close(self) -> None:
        """Close the client; goals go on."""


ActionUse: TypeAlias = "Use[ActionPort]"
"""The use of a client of an action, until it is closed."""


class _Ros2Port(ActionPort):
    """A client by the protocol of ROS 2."""

    def __init__(self, node: Node, name: str, cls: type[Any]) -> None:
        super().__init__(name, cls.Goal)
        self._client = node.action_client(name, cls)
        self._subscription = node.subscription(
            f"{name}/{STATUS}", StatusArray, self._receive, qos=LATCHED
        )

    def send(self, goal: SentGoal, message: Any) -> None:
        sent = self._client.send(
            message,
            feedback=goal.add_feedback,
            on_status=lambda native: goal.advance(native.status.text),
            timeout=_TIMEOUT,
        )
        goal.id = str(sent.id)
        goal.advance(sent.status.text)
        sent.on_done(lambda native: self._finish(goal, native))

    def _finish(self, goal: SentGoal, native: ClientGoal) -> None:
        try:
            goal.finish(native.status.text, native.result(0))
        except GoalFailed as error:
            goal.finish(native.status.text, error.result)
        except RoszError as error:
            goal.finish("lost", None, str(error))

    def cancel(self, goal_id: str) -> str:
        info = GoalInfo(UUID(uuid.UUID(goal_id).bytes)) if goal_id else GoalInfo()
        count = len(self._client.request_cancel(info, _TIMEOUT).goals_canceling)
        if goal_id and not count:
            raise ActionError(
                f"the server of '{self._name}' does not cancel the goal: it refuses, or the goal"
                " has ended"
            )
        return f"the server cancels {count} goal{'s' * (count != 1)}"

    def _row(self, status: Any) -> GoalRow:
        info, number = status.goal_info, status.status
        state = GoalState(number) if number in tuple(GoalState) else GoalState.UNKNOWN
        goal_id = str(uuid.UUID(bytes=bytes(info.goal_id.uuid)))
        return GoalRow(goal_id, state.text, state not in FINAL, info.stamp.to_nsec())

    def close(self) -> None:
        self._subscription.close()
        self._client.close()


class _ActionlibPort(ActionPort):
    """A client by actionlib's topics."""

    def __init__(self, node: Node, name: str, cls: type[Any]) -> None:
        super().__init__(name, ActionTypes.of(cls, node.context.types).goal)
        self._client = ActionlibClient(node, name, cls)
        self._goals: dict[str, ActionlibClientGoal] = {}
        self._subscription = node.subscription(f"{name}/status", GoalStatusArray, self._receive)

    def send(self, goal: SentGoal, message: Any) -> None:
        self._wait()
        sent = self._client.send(
            message,
            on_done=lambda followed: self._finish(goal, followed),
            on_feedback=goal.add_feedback,
            on_transition=lambda followed: goal.advance(_state_text(followed.status)),
        )
        goal.id = sent.id.id
        goal.advance("pending")
        if not goal.done:
            self._goals[goal.id] = sent

    def _wait(self) -> None:
        if not self._client.wait_for_server(_TIMEOUT):
            raise ActionError(f"the server of '{self._name}' was not there within {_TIMEOUT:g} s")

    def _finish(self, goal: SentGoal, sent: ActionlibClientGoal) -> None:
        self._goals.pop(sent.id.id, None)
        lost = sent.status.status == GoalStatus.LOST
        fault = sent.status.text if lost or sent.result is None else ""
        goal.finish(_state_text(sent.status), sent.result, fault)

    def cancel(self, goal_id: str) -> str:
        self._wait()
        sent = self._goals.get(goal_id)
        if sent is not None:
            sent.cancel()
        else:
            self._client.publish_cancel(GoalID(id=goal_id))
        return "the server was asked to cancel " + ("the goal" if goal_id else "all goals")

    def _row(self, status: Any) -> GoalRow:
        running = status.status in tuple(ActionlibState) and status.status not in TERMINAL
        goal_id = status.goal_id
        return GoalRow(goal_id.id, _state_text(status), running, goal_id.stamp.to_nsec())

    def close(self) -> None:
        self._subscription.close()
        self._client.stop()


def _state_text(status: GoalStatus) -> str:
    number = status.status
    return ActionlibState(number).text if number in tuple(ActionlibState) else str(number)


class Actions:
    """The actions of the system, and the goals that pages have sent.

    Args:
        node: The node that sends them.
        permission: The changes that pages may make.
    """

    def __init__(self, node: Node, permission: PagePolicy) -> None:
        self._node = node
        self._permission = permission
        self._lock = threading.Lock()
        self._goals: deque[SentGoal] = deque(maxlen=_MOST_GOALS)
        self._ports: dict[str, SharedResource[ActionPort]] = {}
        self._uses: dict[SentGoal, Use[ActionPort]] = {}
        self._view: View = View(())
        self._worker = Worker("rosz-web-goals", run_task)

    def rows(self, view: View) -> list[ActionRow]:
        """Return the actions that nodes serve, sorted by name."""
        rows = {
            entry.name: ActionRow(
                entry.name, entry.types[0].replace("/action/", "/"), entry.servers, "ROS 2"
            )
            for entry in list_actions(view)
            if entry.servers
        }
        for name, types in view.topics().items():
            action = name.removesuffix("/goal")
            kind = short_type(types[0])
            if action == name or action in rows or not kind.endswith(_GOAL):
                continue
            servers = {token.node_name for token in view.publishers(f"{action}/result")}
            if servers:
                kind = kind.removesuffix(_GOAL)
                rows[action] = ActionRow(action, kind, tuple(sorted(servers)), "actionlib")
        return [rows[name] for name in sorted(rows)]

    def use(self, view: View, name: str) -> ActionUse:
        """Open a client of an action, which all share; it may take some seconds.

        Raises:
            NotFoundError: No node serves it, or the server cannot describe it.
            TypeNotFound: Its type is not known here.
            ServiceError: The server ended before it described it.
            WaitTimeout: It did not describe it in time.
        """
        with self._lock:
            self._view = view
            shared = self._ports.setdefault(name, SharedResource(lambda: self._open(name)))
        return shared.use()

    def _open(self, name: str) -> ActionPort:
        view = self._view
        row = next((candidate for candidate in self.rows(view) if candidate.name == name), None)
        if row is None:
            raise NotFoundError(f"no node serves action '{name}'")
        if row.protocol == "ROS 2":
            return _Ros2Port(self._node, name, action_type(self._node, view, name))
        types = self._node.context.types
        return _ActionlibPort(self._node, name, types.message(f"{row.type}Action"))

    def goals(self, action: str) -> list[SentGoal]:
        """Return the goals that were sent to an action, the newest first."""
        with self._lock:
            return [goal for goal in reversed(self._goals) if goal.action == action]

    def send(self, view: View, name: str, text: str) -> SentGoal:
        """Send a goal, and wait until the server has accepted it.

        Args:
            view: The running nodes.
            name: Full name of the action.
            text: The goal in YAML.

        Raises:
            UsageError: The text is not YAML, or the page may not send it.
            EncodeError: A value does not fit the goal.
            ActionError: The server rejected the goal, or was not there.
            RoszError: The server did not answer, or failed.
        """
        self._permission.check("call", name)
        use = self.use(view, name)
        goal = SentGoal(name, text, self._release)
        with self._lock:
            self._uses[goal] = use
        try:
            use.value.send(goal, read_form(use.value.goal_type, text, self._node.now()))
        except RoszError:
            self._release(goal)
            raise
        with self._lock:
            self._goals.append(goal)
        return goal

    def _release(self, goal: SentGoal) -> None:
        """Close the client that follows a goal, unless others use it."""
        with self._lock:
            use = self._uses.pop(goal, None)
        if use is not None:
            self._worker.later(_LATE_SECONDS, use.close)

    def cancel(self, view: View, name: str, goal_id: str = "") -> str:
        """Ask the server to end a goal, or all goals of all clients; return its answer as text.

        Args:
            view: The running nodes.
            name: Full name of the action.
            goal_id: Identification of the goal; all goals when not given.

        Raises:
            UsageError: The page may not.
            ActionError: The server refuses, or the goal has ended.
            RoszError: The server did not answer.
        """
        self._permission.check("call", name)
        use = self.use(view, name)
        try:
            return use.value.cancel(goal_id)
        finally:
            self._worker.later(_LATE_SECONDS, use.close)

    def close(self) -> None:
        """Follow no goals any more; they go on."""
        self._worker.close()
        with self._lock:
            uses = list(self._uses.values())
            self._uses.clear()
        for use in uses:
            use.close()
