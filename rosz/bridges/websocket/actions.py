"""Actions: clients send goals to servers of the network, and serve some actions themselves."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from rosz.actions import ActionGateway
from rosz.bridges.websocket.messages import build
from rosz.bridges.websocket.operations import (
    ActionFeedback,
    ActionResult,
    AdvertiseAction,
    CancelActionGoal,
    SendActionGoal,
)
from rosz.bridges.websocket.plain import Spelling, converter
from rosz.errors import ActionError, RoszError, UsageError
from rosz.node.goals import SEND, GoalState

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosz.node import Node
    from rosz.node.action_client import ActionClient, ClientGoal
    from rosz.node.action_server import ActionServer, ServerGoal

__all__ = ("Gateways", "SentGoals", "ServedActions")

_GOAL = "/goal"


class Gateways:
    """Servers of ROS 2 that clients reach by actionlib's topics.

    Args:
        node: Node that has the topics.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._known: dict[str, tuple[ActionGateway, set[object]]] = {}

    def want(self, topic: str, cls: type[Any], client: object) -> None:
        """See that goals which a client publishes reach a server of ROS 2, if only that is there.

        Args:
            topic: Topic of the client, which may be one for goals.
            cls: Class of its messages.
            client: The client.

        Raises:
            RoszError: The definition of the action is not found.
        """
        name, kind = topic.removesuffix(_GOAL), cls._type
        if name == topic or not kind.endswith("ActionGoal"):
            return
        with self._lock:
            if name in self._known:
                self._known[name][1].add(client)
                return
            view = self._node.context.graph.refresh()
            if view.subscriptions(topic) or not view.servers(f"{name}/{SEND}"):
                return
            action = self._node.context.types.message(kind.removesuffix("Goal"))
            gateway = ActionGateway(self._node, name, action)
            if gateway.start():
                self._known[name] = gateway, {client}
            else:
                gateway.close()

    def leave(self, client: object) -> None:
        """Close the gateways that no other client needs."""
        with self._lock:
            for name, (gateway, clients) in list(self._known.items()):
                clients.discard(client)
                if not clients:
                    del self._known[name]
                    gateway.close()


class SentGoals:
    """The goals that one client has sent.

    Args:
        node: Node that sends them.
        send: Function that sends an operation to the client.
    """

    def __init__(self, node: Node, send: Callable[[dict[str, Any]], object]) -> None:
        self._node = node
        self._send = send
        self._lock = threading.Lock()
        self._clients: dict[tuple[str, str], ActionClient] = {}
        self._goals: dict[str, ClientGoal | None] = {}
        self._canceled: set[str] = set()

    def announce(self, operation: SendActionGoal) -> None:
        """Remember that a goal is about to be sent, so that it can be canceled."""
        with self._lock:
            self._goals[str(operation.id)] = None

    def forget(self, operation: SendActionGoal) -> None:
        """Forget a goal that was not accepted."""
        with self._lock:
            self._goals.pop(str(operation.id), None)
            self._canceled.discard(str(operation.id))

    def send(self, name: str, operation: SendActionGoal, spelling: Spelling) -> None:
        """Send a goal; feedback and the result go to the client.

        Raises:
            RoszError: The goal was not accepted, or the arguments do not fit.
        """
        kind = self._node.context.types.action(operation.action_type)
        head = {"id": operation.id, "action": name}
        plain = converter(kind.Feedback, spelling)

        def report(feedback: Any) -> None:
            if operation.feedback:
                self._send({"op": "action_feedback", **head, "values": plain(feedback)})

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
        with self._lock:
            self._goals.pop(key, None)
            self._canceled.discard(key)
        values: Any
        try:
            values, known = plain(handle.result(0)), True
        except ActionError as error:
            outcome = getattr(error, "result", None)
            known = outcome is not None
            values = plain(outcome) if known else str(error)
        except RoszError as error:
            values, known = str(error), False
        status = int(handle.status)
        self._send(
            {"op": "action_result", **head, "values": values, "status": status, "result": known}
        )

    def cancel(self, operation: CancelActionGoal) -> None:
        """Cancel a goal, also one that has not been accepted yet.

        Raises:
            RoszError: The goal is unknown, or the server did not answer.
        """
        key = str(operation.id)
        with self._lock:
            if key not in self._goals:
                raise UsageError(f"no goal with the id '{key}' is executed")
            handle = self._goals[key]
            if handle is None:
                self._canceled.add(key)
        if handle is not None:
            handle.cancel()

    def close(self) -> None:
        """End all clients of actions; goals that have not ended are left to their servers."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for client in clients:
            client.close()


class ServedActions:
    """The actions that one client serves.

    Args:
        node: Node that has them.
        send: Function that sends an operation to the client.
    """

    def __init__(self, node: Node, send: Callable[[dict[str, Any]], object]) -> None:
        self._node = node
        self._send = send
        self._lock = threading.Lock()
        self._servers: dict[str, ActionServer] = {}
        self._goals: dict[str, tuple[ServerGoal, Any, Future[ActionResult]]] = {}

    def advertise(self, name: str, operation: AdvertiseAction, spelling: Spelling) -> None:
        """Serve an action with what the client does.

        Raises:
            RoszError: The type does not exist.
        """
        kind = self._node.context.types.action(operation.type)
        execute = partial(self._execute, name, operation.type, kind, spelling)

        def cancel(goal: ServerGoal) -> bool:
            self._send({"op": "cancel_action_goal", "id": str(goal.id), "action": name})
            return True

        self.unadvertise(name)
        server = self._node.action_server(name, kind, execute, cancel=cancel)
        with self._lock:
            self._servers[name] = server

    def _execute(
        self, name: str, type_name: str, kind: Any, spelling: Spelling, goal: ServerGoal
    ) -> None:
        pending: Future[ActionResult] = Future()
        key = str(goal.id)
        with self._lock:
            self._goals[key] = goal, kind, pending
        try:
            args = converter(kind.Goal, spelling)(goal.request)
            sent = {"op": "send_action_goal", "id": key, "action": name, "action_type": type_name}
            self._send({**sent, "args": args, "feedback": True})
            answer = pending.result()
        finally:
            with self._lock:
                self._goals.pop(key, None)
        if not goal.done:
            self._finish(goal, kind, answer)

    def _finish(self, goal: ServerGoal, kind: Any, answer: ActionResult) -> None:
        values = answer.values if isinstance(answer.values, dict | list) else None
        result = build(kind.Result, values or None, self._node.now())
        if not answer.result or answer.status == GoalState.ABORTED:
            goal.abort(result)
        elif answer.status == GoalState.CANCELED:
            goal.canceled(result)
        else:
            goal.succeed(result)

    def feedback(self, operation: ActionFeedback) -> None:
        """Publish feedback of the client about a goal.

        Raises:
            RoszError: The goal is not executed, or the values do not fit.
        """
        goal, kind, _ = self._find(operation.id)
        goal.feedback(build(kind.Feedback, operation.values or None, self._node.now()))

    def end(self, operation: ActionResult) -> None:
        """End a goal as the client says.

        Raises:
            UsageError: The goal is not executed.
        """
        _, _, pending = self._find(operation.id)
        if not pending.done():
            pending.set_result(operation)

    def _find(self, number: object) -> tuple[ServerGoal, Any, Future[ActionResult]]:
        with self._lock:
            found = self._goals.get(str(number))
        if found is None:
            raise UsageError(f"no goal with the id '{number}' is executed")
        return found

    def unadvertise(self, name: str) -> bool:
        """Serve an action no longer; return whether the client served it."""
        with self._lock:
            server = self._servers.pop(name, None)
        if server is not None:
            server.close()
        return server is not None

    def close(self) -> None:
        """End all actions; their goals are aborted."""
        with self._lock:
            servers, goals = list(self._servers.values()), list(self._goals.values())
            self._servers.clear()
        for goal, _, pending in goals:
            with suppress(UsageError):  # it has just ended
                goal.abort()
            if not pending.done():
                pending.set_result(ActionResult(action="", result=False))
        for server in servers:
            server.close()
