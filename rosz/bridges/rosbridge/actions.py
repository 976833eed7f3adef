"""Actions: clients send goals to servers of the network, and serve some actions themselves."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any

from rosz.actions import ActionClient, ActionServer, ClientGoal, GoalState, ServerGoal
from rosz.bridges.clients import build
from rosz.bridges.rosbridge import operations as ops
from rosz.bridges.rosbridge.plain import Spelling, converter
from rosz.bridges.rosbridge.state import ClientState, Served
from rosz.errors import ActionError, RoszError, UsageError


class SentGoals:
    """The goals that one client sends."""

    def __init__(self, state: ClientState) -> None:
        self._state = state
        self._node = state.shared.node
        self._lock = threading.Lock()
        self._clients: dict[tuple[str, str], ActionClient] = {}
        self._goals: dict[str, ClientGoal | None] = {}
        self._canceled: set[str] = set()

    def send(self, operation: ops.SendActionGoal) -> None:
        """Send a goal, soon; feedback and the result go to the client."""
        spelling = self._state.spelling_of(operation.action_type)
        name = self._node.resolve(operation.action)
        try:
            with self._lock:
                self._state.shared.limits.check("calls", len(self._goals))
                self._goals[str(operation.id)] = None  # so that it can be canceled
            self._state.later(partial(self._send, name, operation, spelling))
        except UsageError as error:
            self._fail(operation, error)

    def _send(self, name: str, operation: ops.SendActionGoal, spelling: Spelling) -> None:
        try:
            self._state.shared.policy.check("call", name)
            self._send_goal(name, operation, spelling)
        except RoszError as error:
            self._fail(operation, error)

    def _fail(self, operation: ops.SendActionGoal, error: RoszError) -> None:
        self._forget(str(operation.id))
        result = {"op": "action_result", "id": operation.id, "action": operation.action}
        self._state.send({**result, "values": str(error), "status": 0, "result": False})

    def _forget(self, key: str) -> None:
        with self._lock:
            self._goals.pop(key, None)
            self._canceled.discard(key)

    def _send_goal(self, name: str, operation: ops.SendActionGoal, spelling: Spelling) -> None:
        kind = self._node.context.types.action(operation.action_type)
        head = {"id": operation.id, "action": name}
        plain = converter(kind.Feedback, spelling)

        def report(feedback: Any) -> None:
            if operation.feedback:
                self._state.send({"op": "action_feedback", **head, "values": plain(feedback)})

        client = self._client(name, kind)
        goal = build(kind.Goal, operation.args or None, self._node.now())
        handle = client.send(goal, feedback=report)
        key = str(operation.id)
        with self._lock:
            self._goals[key] = handle
            canceled = key in self._canceled
        handle.on_done(partial(self._end, key, head, converter(kind.Result, spelling)))
        if canceled:
            handle.cancel()

    def _client(self, name: str, kind: Any) -> ActionClient:
        with self._lock:
            client = self._clients.get((name, kind._type_name))
            if client is None:
                client = self._node.action_client(name, kind)
                self._clients[name, kind._type_name] = client
            return client

    def _end(
        self, key: str, head: dict[str, Any], plain: Callable[[Any], Any], handle: ClientGoal
    ) -> None:
        self._forget(key)
        values: Any
        try:
            values, has_result = plain(handle.result(0)), True
        except ActionError as error:
            outcome = getattr(error, "result", None)
            has_result = outcome is not None
            values = plain(outcome) if has_result else str(error)
        except RoszError as error:
            values, has_result = str(error), False
        end = {"values": values, "status": int(handle.status), "result": has_result}
        self._state.send({"op": "action_result", **head, **end})

    def cancel(self, operation: ops.CancelActionGoal) -> None:
        """Cancel a goal, soon; also one that has not been accepted yet.

        Raises:
            UsageError: Operations of this client that have not ended are too large together.
        """
        self._state.later(partial(self._cancel, operation))

    def _cancel(self, operation: ops.CancelActionGoal) -> None:
        key = str(operation.id)
        try:
            with self._lock:
                if key not in self._goals:
                    raise UsageError(f"no goal with the id '{key}' is executed")
                handle = self._goals[key]
                if handle is None:
                    self._canceled.add(key)
            if handle is not None:
                handle.cancel()
        except RoszError as error:
            self._state.report("error", f"cancel_action_goal: {error}", operation.id)

    def close(self) -> None:
        """End all clients of actions; goals that have not ended are left to their servers."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for client in clients:
            client.close()


class ServedActions(Served[ActionServer]):
    """The actions that one client serves."""

    def __init__(self, state: ClientState) -> None:
        super().__init__(state)
        self._goals: dict[str, tuple[ServerGoal, Any, Future[ops.ActionResult]]] = {}

    def advertise(self, operation: ops.AdvertiseAction) -> None:
        """Serve an action; the client executes its goals.

        Raises:
            RoszError: The client may not, or the type does not exist.
        """
        spelling = self._state.spelling_of(operation.type)
        name = self._node.resolve(operation.action)
        self._check(name)
        kind = self._node.context.types.action(operation.type)
        execute = partial(self._execute, name, operation.type, kind, spelling)

        def cancel(goal: ServerGoal) -> bool:
            self._state.send({"op": "cancel_action_goal", "id": str(goal.id), "action": name})
            return True

        self._end_server(name)
        server = self._node.action_server(name, kind, execute, cancel=cancel)
        with self._lock:
            self._servers[name] = server

    def _execute(
        self, name: str, type_name: str, kind: Any, spelling: Spelling, goal: ServerGoal
    ) -> None:
        pending: Future[ops.ActionResult] = Future()
        key = str(goal.id)
        with self._lock:
            self._goals[key] = goal, kind, pending
        try:
            args = converter(kind.Goal, spelling)(goal.request)
            sent = {"op": "send_action_goal", "id": key, "action": name, "action_type": type_name}
            self._state.send({**sent, "args": args, "feedback": True})
            answer = pending.result()
        finally:
            with self._lock:
                self._goals.pop(key, None)
        if not goal.done:
            self._finish(goal, kind, answer)

    def _finish(self, goal: ServerGoal, kind: Any, answer: ops.ActionResult) -> None:
        values = answer.values if isinstance(answer.values, dict | list) else None
        result = build(kind.Result, values or None, self._node.now())
        if not answer.result or answer.status == GoalState.ABORTED:
            goal.abort(result)
        elif answer.status == GoalState.CANCELED:
            goal.canceled(result)
        else:
            goal.succeed(result)

    def feedback(self, operation: ops.ActionFeedback) -> None:
        """Publish feedback of the client about a goal.

        Raises:
            RoszError: The goal is not executed, or the values do not fit.
        """
        goal, kind, _ = self._find(operation.id)
        goal.feedback(build(kind.Feedback, operation.values or None, self._node.now()))

    def end(self, operation: ops.ActionResult) -> None:
        """End a goal as the client says.

        Raises:
            UsageError: The goal is not executed.
        """
        _, _, pending = self._find(operation.id)
        if not pending.done():
            pending.set_result(operation)

    def _find(self, number: object) -> tuple[ServerGoal, Any, Future[ops.ActionResult]]:
        with self._lock:
            executed = self._goals.get(str(number))
        if executed is None:
            raise UsageError(f"no goal with the id '{number}' is executed")
        return executed

    def unadvertise(self, operation: ops.UnadvertiseAction) -> None:
        """Serve an action no longer."""
        self._withdraw(operation, operation.action)

    def close(self) -> None:
        """End all actions; their goals are aborted."""
        with self._lock:
            servers, goals = list(self._servers.values()), list(self._goals.values())
            self._servers.clear()
        for goal, _, pending in goals:
            with suppress(UsageError):  # it has just ended
                goal.abort()
            if not pending.done():
                pending.set_result(ops.ActionResult(action="", result=False))
        for server in servers:
            server.close()
