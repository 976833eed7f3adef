"""Action servers that execute one goal at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rosz.actions.actionlib_server import ActionlibServer
from rosz.actions.types import run_callback
from rosz.node.actions import RUNNING
from rosz.worker import Worker

_CHECK_PERIOD = 0.2
_SUPERSEDED = "This goal was canceled because another goal was received by the simple action server"


class SimpleActionServer:
    """Execute one goal at a time; a newer goal preempts the current one.

    A goal that arrives becomes the `next_goal`, and recalls an earlier one that still waits there.
    `accept_new_goal` makes it the `current_goal`. Without ``execute``, the program calls that when
    `on_goal` is called.

    Args:
        server: Server that receives the goals; not started yet.
        execute: Function called with each goal message on a thread of the server. It must end with
            `set_succeeded`, `set_aborted` or `set_preempted`.

    Attributes:
        action_server: The server.
        current_goal: Goal that was accepted last; None at first.
        next_goal: Goal that arrived last; None at first.
        new_goal: Whether the next goal waits to be accepted.
        preempt_request: Whether the current goal was cancelled, or a newer one waits.
        new_goal_preempt_request: Whether the next goal was cancelled before it was accepted.
        on_goal: Function called when a goal has arrived.
        on_preempt: Function called when the current goal is asked to end.
    """

    def __init__(
        self, server: ActionlibServer, execute: Callable[[Any], object] | None = None
    ) -> None:
        self.action_server: Any = server
        self.execute_callback: Callable[[Any], object] | None = execute
        self.current_goal: Any = None
        self.next_goal: Any = None
        self.new_goal: bool = False
        self.preempt_request: bool = False
        self.new_goal_preempt_request: bool = False
        self.on_goal: Callable[[], object] | None = None
        self.on_preempt: Callable[[], object] | None = None
        self.lock = server.lock
        self._arrived = threading.Condition(self.lock)
        self._worker: Worker[Any] | None = None
        server.on_goal, server.on_cancel = self._receive, self._cancel

    def start(self) -> None:
        """Begin to receive goals."""
        self.action_server.start()
        if self.execute_callback is not None and self._worker is None:
            name = f"rosz-action{self.action_server.name}"
            self._worker = Worker(name, self._execute, receive=self._wait_for_goal)
            self.action_server.node.on_shutdown(lambda _: self._wake())

    def is_new_goal_available(self) -> bool:
        """Return whether there is a goal to accept."""
        return self.new_goal

    def is_preempt_requested(self) -> bool:
        """Return whether the current goal was cancelled or a newer goal waits."""
        return self.preempt_request

    def is_active(self) -> bool:
        """Return whether a goal is being executed."""
        goal = self.current_goal
        return _is_goal(goal) and goal.status.status in RUNNING

    def accept_new_goal(self) -> Any:
        """Accept the goal that waits; a goal that is being executed is preempted.

        Returns:
            The goal message; None if no goal waits.
        """
        with self.lock:
            if not self.new_goal or not _is_goal(self.next_goal):
                self.action_server.node.log.error("cannot accept a goal: none is waiting")
                return None
            if self.is_active() and self.current_goal is not self.next_goal:
                self.current_goal.cancel(text=_SUPERSEDED)
            self.current_goal, self.new_goal = self.next_goal, False
            self.preempt_request = self.new_goal_preempt_request
            self.new_goal_preempt_request = False
            self.current_goal.accept("This goal has been accepted by the simple action server")
            return self.current_goal.message.goal

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the current goal as succeeded."""
        self._end("succeed", result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the current goal as aborted."""
        self._end("abort", result, text)

    def set_preempted(self, result: Any = None, text: str = "") -> None:
        """End the current goal as preempted: cancelled, or replaced by a newer one."""
        self._end("cancel", result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback about the current goal."""
        goal = self.current_goal
        if _is_goal(goal):
            goal.publish_feedback(feedback)
        else:
            self.action_server.node.log.error("cannot publish feedback: no goal was accepted")

    def get_default_result(self) -> Any:
        """Return an empty result message."""
        return self.action_server.types.result()

    def _end(self, how: str, result: Any, text: str) -> None:
        with self.lock:  # while a new goal is accepted there are two current ones
            if _is_goal(self.current_goal):
                getattr(self.current_goal, how)(result, text)
            else:
                self.action_server.node.log.error("cannot end a goal: none was accepted")

    def _wake(self) -> None:
        with self.lock:
            self._arrived.notify_all()

    def _receive(self, goal: Any) -> None:
        with self.lock:
            others = [other for other in (self.current_goal, self.next_goal) if _is_goal(other)]
            if any(goal.id.stamp.to_nsec() < other.id.stamp.to_nsec() for other in others):
                goal.cancel(text=_SUPERSEDED)
                return
            older, self.next_goal = self.next_goal, goal
            if _is_goal(older) and older is not self.current_goal:
                older.cancel(text=_SUPERSEDED)
            self.new_goal, self.new_goal_preempt_request = True, False
            preempts = self.is_active()
            self.preempt_request = self.preempt_request or preempts
            self._arrived.notify_all()
        server = self.action_server
        if preempts:
            run_callback(server.node, server.name, self.on_preempt)
        run_callback(server.node, server.name, self.on_goal)

    def _cancel(self, goal: Any) -> None:
        with self.lock:
            current = goal is self.current_goal
            if current:
                self.preempt_request = True
            elif goal is self.next_goal:
                self.new_goal_preempt_request = True
        if current:
            run_callback(self.action_server.node, self.action_server.name, self.on_preempt)

    def _wait_for_goal(self) -> Any:
        """Accept the next goal when it has arrived; None when the node is shut down."""
        with self.lock:
            while not self.action_server.node.is_shutdown:
                if self.new_goal:
                    return self.accept_new_goal()
                self._arrived.wait(_CHECK_PERIOD)
        return None

    def _execute(self, goal: Any) -> None:
        node, name = self.action_server.node, self.action_server.name
        execute = self.execute_callback
        if execute is None:
            return
        try:
            execute(goal)
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            if node.is_shutdown:
                return
            node.log.report(f"the execute function of action '{name}' failed", error)
            if self.is_active():
                self.set_aborted(None, f"Exception in execute callback: {error}")
            return
        if self.is_active() and not node.is_shutdown:
            node.log.warning(
                "the execute function of action '%s' returned without ending the goal, which is"
                " aborted; call set_succeeded, set_aborted or set_preempted",
                name,
            )
            self.set_aborted(None, "No terminal state was set.")


def _is_goal(goal: Any) -> bool:
    return goal is not None and goal.message is not None
