"""Clients of actionlib's protocol, which send goals and follow their states."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterable
from typing import Any

from rosz.actions.comm_state import CommState, path
from rosz.actions.translation import ActionlibToRos2
from rosz.actions.types import ActionTypes, publish, run_callback
from rosz.errors import ClosedError, WaitTimeout
from rosz.graph import View
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node import MessageInfo, Node
from rosz.node.actions import LONGEST_SILENCE, RUNNING, TERMINAL, ServerWatch
from rosz.session import LONGEST_WAIT
from rosz.wire import Kind, format_token, gid

_CHECK_PERIOD = 0.1
"""Seconds between two looks at the node's clock, which may be simulated, during a wait."""

_ACTIVE_TIMEOUT = 1.0
"""Seconds that `on_done` waits for `on_active` to return."""

_EXECUTED = frozenset({GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.PREEMPTED})
"""Terminal states of goals that were executed."""

_ENDED = "the server ended"

_numbers = itertools.count(1)


class ActionlibClientGoal:
    """A goal that was sent; see `ActionlibClient.send`.

    Attributes:
        id: Identification of the goal in messages.
        status: Last known state, with the text of the server.
        comm_state: State of the goal in the client, a constant of `CommState`.
        result: Result of the goal; None while there is none.
        started: Whether the server has started to execute the goal.
    """

    def __init__(
        self,
        client: ActionlibClient,
        goal_id: GoalID,
        on_done: Callable[[ActionlibClientGoal], object] | None,
        on_active: Callable[[], object] | None,
        on_feedback: Callable[[Any], object] | None,
        on_transition: Callable[[ActionlibClientGoal], object] | None,
    ) -> None:
        self.id: GoalID = goal_id
        self.comm_state: int = CommState.WAITING_FOR_GOAL_ACK
        self.status: GoalStatus = GoalStatus(goal_id, GoalStatus.PENDING)
        self.result: Any = None
        self.started: bool = False
        self._client = client
        self._on_done = on_done
        self._on_active = on_active
        self._on_feedback = on_feedback
        self._on_transition = on_transition
        self._transition_lock = threading.RLock()
        self._lock = threading.RLock()
        self._active_thread = 0
        self._active_over = threading.Event()
        self._active_over.set()
        self._listed = False
        self._finished = False
        self._done = threading.Event()

    @property
    def done(self) -> bool:
        """Whether the goal has ended."""
        return self._done.is_set()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the goal has ended or the node is shut down.

        Args:
            timeout: Time limit in seconds of the node's clock; no limit when not given or 0.

        Returns:
            Whether the goal has ended.
        """
        if threading.get_ident() == self._active_thread:
            if self._finished:
                return True  # this thread calls `on_done` next
            self._active_over.set()  # otherwise `finish` waits for the callback that called this
        node = self._client.node
        limit = round((timeout or LONGEST_WAIT) * 1e9)
        began = node.now()
        while not self._done.wait(_CHECK_PERIOD):
            if node.is_shutdown or node.now() - began >= limit:
                return self.done
        return True

    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        self._client.cancel(self)
        if not self._finished:
            self._transition((CommState.WAITING_FOR_CANCEL_ACK,))

    def forget(self) -> None:
        """Stop following the goal; the server continues with it."""
        self._client.forget(self)

    def update(self, statuses: list[GoalStatus]) -> None:
        """Update the state of the goal from a status message."""
        if self._finished:
            return
        for status in statuses:
            if status.goal_id.id == self.id.id:
                self._listed = True
                self.advance(status)
                return
        if self._listed:  # the server was restarted, and has lost the goal
            text = "the server does not know the goal any more"
            self.finish(GoalStatus(self.id, GoalStatus.LOST, text), None)

    def advance(self, status: GoalStatus) -> None:
        """Store a new state of the goal, unless the state is terminal."""
        with self._lock:
            if self._finished or status.status in TERMINAL:
                return  # `finish` sets a terminal state when the result arrives
            self.status = status
            starts = self._starts(status.status in RUNNING)
        self._follow(status.status)
        if starts:
            self._activate()

    def _follow(self, status: int) -> None:
        states = path(self.comm_state, status)
        if states is None:
            self._client.node.log.error(
                "a goal of action '%s' in state %s cannot get status %s",
                self._client.name,
                self.comm_state,
                status,
            )
        else:
            self._transition(states)

    def _transition(self, states: Iterable[int]) -> None:
        """Set each state in turn, and call the transition callback."""
        # The time limit prevents a deadlock with a callback that waits for the end of the goal.
        taken = self._transition_lock.acquire(timeout=_ACTIVE_TIMEOUT)
        try:
            for state in states:
                self.comm_state = state
                self._call(self._on_transition, self)
        finally:
            if taken:
                self._transition_lock.release()

    def _starts(self, running: bool) -> bool:
        """Set `started` at the first state of execution; return whether this call set it."""
        if self.started or not running:
            return False
        self.started = True
        self._active_over.clear()
        return True

    def _activate(self) -> None:
        self._active_thread = threading.get_ident()
        self._call(self._on_active)
        self._active_thread = 0
        self._active_over.set()

    def receive_feedback(self, feedback: Any) -> None:
        """Call the feedback callback."""
        if not self.done:
            self._call(self._on_feedback, feedback)

    def finish(self, status: GoalStatus, result: Any) -> None:
        """End the goal with a terminal state and a result."""
        with self._lock:
            if self._finished:
                return
            self._finished = True
            self.status, self.result = status, result
            starts = self._starts(status.status in _EXECUTED)
        if status.status != GoalStatus.LOST:
            self._follow(status.status)
        self._transition((CommState.DONE,))
        if starts:
            self._activate()
        # `on_done` is called after `on_active` has returned, or after the time limit.
        self._active_over.wait(_ACTIVE_TIMEOUT)
        self._call(self._on_done, self)
        self._done.set()
        self.forget()

    def _call(self, callback: Callable[..., object] | None, *arguments: Any) -> None:
        run_callback(self._client.node, self._client.name, callback, *arguments)


class ActionlibClient:
    """Send goals to an action server.

    Args:
        node: Node that the client belongs to.
        name: Name of the action; resolved and remapped.
        action_type: Class of the action, such as ``FibonacciAction``.
        has_ros2: Whether to reach servers that support only ROS 2's protocol.

    Attributes:
        node: Node that the client belongs to.
        name: Full name of the action.

    Raises:
        UsageError: The class is not an action class.
    """

    def __init__(
        self, node: Node, name: str, action_type: type[Any], *, has_ros2: bool = True
    ) -> None:
        self._types = types = ActionTypes.of(action_type, node.context.types)
        self.node: Node = node
        self.name: str = node.resolve(name)
        self._goals: dict[str, ActionlibClientGoal] = {}
        self._ros2: ActionlibToRos2 | None = None
        if types.action is not None and has_ros2:
            self._ros2 = ActionlibToRos2(node, self.name, types, types.action)
        self._served = False
        self._watch = node.keep(
            ServerWatch(self.name, self._own_goals, self._check_server, node.log, queries=False)
        )
        self._goal_publisher = node.publisher(f"{self.name}/goal", types.action_goal)
        self._cancel_publisher = node.publisher(f"{self.name}/cancel", GoalID)
        self._heard = b"", 0
        status = node.subscription(
            f"{self.name}/status", GoalStatusArray, self._receive_status, with_info=True
        )
        self._status = status
        self._subscriptions = [
            status,
            node.subscription(
                f"{self.name}/feedback", types.action_feedback, self._receive_feedback
            ),
            node.subscription(f"{self.name}/result", types.action_result, self._receive_result),
        ]

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait until a server of the action is connected.

        A server of ROS 1's protocol publishes its status when it is ready for goals. It is
        connected when a status was received and its other topics are connected.

        Args:
            timeout: Time limit in seconds; no limit when not given or 0.

        Returns:
            Whether a server is connected; false if the node is shut down during the wait.
        """
        topics = [f"{self.name}/{topic}" for topic in ("status", "feedback", "result")]

        def is_connected(view: View) -> bool:
            if self._ros2 is not None and self._ros2.is_served():
                return True
            servers = {
                token.node_name
                for token in view.publishers(self._status.name)
                if gid(format_token(token)) == self._heard[0]
            }
            for topic in topics[1:]:
                servers &= {token.node_name for token in view.publishers(topic)}
            for publisher in (self._goal_publisher, self._cancel_publisher):
                servers &= {token.node_name for token in publisher.subscribers()}
            return bool(servers)

        graph = self.node.context.graph
        try:
            with graph.follow_entities(Kind.PUBLISHER, *topics) as publishers:
                what = f"action server '{self.name}'"
                publishers.wait_for(is_connected, timeout or LONGEST_WAIT, what)
        except WaitTimeout:
            return False
        except ClosedError:
            if not self.node.is_shutdown:
                raise
            return False
        return True

    def stop(self) -> None:
        """Close all topics, and stop following goals."""
        self.node.forget(self._watch)
        self._watch.close()
        if self._ros2 is not None:
            self._ros2.close()
        for entity in (self._goal_publisher, self._cancel_publisher, *self._subscriptions):
            entity.close()

    def send(
        self,
        goal: Any,
        *,
        on_done: Callable[[ActionlibClientGoal], object] | None = None,
        on_active: Callable[[], object] | None = None,
        on_feedback: Callable[[Any], object] | None = None,
        on_transition: Callable[[ActionlibClientGoal], object] | None = None,
    ) -> ActionlibClientGoal:
        """Send a goal; the protocol is ROS 2's if no server supports ROS 1's.

        After the shutdown of the node, the goal is not sent.

        Args:
            goal: The goal message, such as a ``FibonacciGoal``.
            on_done: Function called with the goal when it has ended.
            on_active: Function called when the server starts to execute the goal.
            on_feedback: Function called with each feedback message.
            on_transition: Function called with the goal at each change of its `comm_state`.

        Returns:
            The goal, which is followed until it ends or `ActionlibClientGoal.forget` is called.
        """
        now = Time(*divmod(self.node.now(), 10**9))
        number = next(_numbers)
        goal_id = GoalID(now, f"{self.node.name}-{number}-{now.sec}.{now.nanosec:09d}")
        sent = ActionlibClientGoal(self, goal_id, on_done, on_active, on_feedback, on_transition)
        self._goals[goal_id.id] = sent
        if self._ros2 is not None and self._ros2.is_served(wait=True):
            self._ros2.send(sent, goal)
            return sent
        message = self._types.action_goal(Header(stamp=now), goal_id, goal)
        publish(self.node, self._goal_publisher, message)
        self._watch.begin(self._status)
        return sent

    def cancel(self, goal: ActionlibClientGoal) -> None:
        """Ask the server to cancel a goal, unless the node is shut down."""
        if self._ros2 is not None and self._ros2.has_sent(goal):
            self._ros2.cancel(goal)
        else:
            publish(self.node, self._cancel_publisher, GoalID(Time(), goal.id.id))

    def publish_cancel(self, goal_id: GoalID) -> None:
        """Ask the server to cancel goals, unless the node is shut down.

        Args:
            goal_id: Identification of a goal. Without an id, its time cancels all goals sent until
                then. Without both, all goals are cancelled, including those of other clients.
        """
        if self._ros2 is not None and self._ros2.is_served(wait=True):
            self._ros2.cancel_all(goal_id)
        else:
            publish(self.node, self._cancel_publisher, goal_id)

    def forget(self, goal: ActionlibClientGoal) -> None:
        """Stop following a goal; see `ActionlibClientGoal.forget`."""
        self._goals.pop(goal.id.id, None)

    def _own_goals(self) -> list[ActionlibClientGoal]:
        """Return the goals that were sent with ROS 1's protocol."""
        ros2 = self._ros2
        return [goal for goal in list(self._goals.values()) if not (ros2 and ros2.has_sent(goal))]

    def _check_server(self) -> None:
        """End the goals if their server has ended or was out of reach for too long."""
        served = bool(self._status.others.view().publishers(self._status.name))
        silence = self._watch.silence
        if self._served and not served and not 0 < silence < LONGEST_SILENCE:
            text = f"the server has been out of reach for {silence:.0f} s" if silence else _ENDED
            for goal in self._own_goals():
                goal.finish(GoalStatus(goal.id, GoalStatus.LOST, text), None)
        self._served = served or (self._served and silence > 0)

    def _receive_status(self, message: GoalStatusArray, info: MessageInfo) -> None:
        server, sequence = self._heard
        if info.gid == server and info.sequence < sequence:
            return  # a newer status has already come from the cache of the server
        self._heard = info.gid, info.sequence
        if info.gid != server:
            self.node.context.graph.check_again()
        self._served = True
        self._watch.note_answer()
        for goal in list(self._goals.values()):
            goal.update(message.status_list)

    def _receive_feedback(self, message: Any) -> None:
        goal = self._goals.get(message.status.goal_id.id)
        if goal is not None:
            goal.receive_feedback(message.feedback)

    def _receive_result(self, message: Any) -> None:
        goal = self._goals.get(message.status.goal_id.id)
        if goal is not None:
            goal.finish(message.status, message.result)
