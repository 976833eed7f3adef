"""Actions of which only one side knows the protocol of ROS 1.

actionlib's clients in C++ know topics alone, and most servers of ROS 2 services alone. For each
action that has a client on one side and its server on the other, a gateway translates, in a node
and a session of its own: what a bridge declares itself is not shown to ROS 1. Actions of programs
that know both protocols need none.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import msgspec

from rosz.actions import ActionGateway, ServiceGateway
from rosz.bridges.ros1.registry import Entry
from rosz.bridges.ros1.shared import BRIDGE, MASTER_NODE, Shared
from rosz.bridges.ros1.sockets import log
from rosz.errors import ClosedError, RoszError
from rosz.node import Context, Node
from rosz.node.goals import SEND
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.wire import Token

__all__ = ("Actions",)

_GOAL = "/goal"
_GOAL_TYPE = "ActionGoal"
_STATUS = "/status"
_STATUS_TYPE = "actionlib_msgs/GoalStatusArray"
_SEND = f"/{SEND}"
_RETRY_SECONDS = 1.0
_MOST_TRIES = 5

_Gateway = ActionGateway | ServiceGateway


class _Sides(msgspec.Struct):
    """The ROS 1 nodes that use an action.

    Attributes:
        type_name: Type of the goal messages; empty if it is not known yet.
        clients: Nodes that send goals.
        servers: Nodes that publish their status.
    """

    type_name: str = ""
    clients: set[str] = msgspec.field(default_factory=set)
    servers: set[str] = msgspec.field(default_factory=set)


class Actions:
    """Opens gateways for actions, and closes them when one of their sides has gone.

    Args:
        shared: What the bridge shares.
    """

    def __init__(self, shared: Shared) -> None:
        self._shared = shared
        self._sides: dict[str, _Sides] = {}
        self._gateways: dict[str, _Gateway] = {}
        self._node: Node | None = None
        self._tries: dict[str, int] = {}
        self._worker: Worker[Callable[[], object]] = Worker("rosz-ros1-actions", logger=log)

    def change(self, entry: Entry, *, alive: bool) -> None:
        """Note that a node of ROS 1 has registered, or has ended."""
        is_goal = entry.name.endswith(_GOAL) and entry.type_name.endswith(_GOAL_TYPE)
        is_status = entry.name.endswith(_STATUS) and entry.type_name == _STATUS_TYPE
        if (is_goal or is_status) and not entry.node.startswith((BRIDGE, MASTER_NODE)):
            self._worker.submit(partial(self._note, entry, alive=alive))

    def update(self, name: str) -> None:
        """Note that something has changed about a topic or service of the network."""
        for end in (_SEND, _STATUS):
            if name.endswith(end):
                self._worker.submit(partial(self._check, name.removesuffix(end)))

    def close(self) -> None:
        """Close all gateways; a second call has no effect."""
        self._worker.close()
        for gateway in self._gateways.values():
            gateway.close()
        self._gateways.clear()
        if self._node is not None:
            self._node.context.close()

    # On the thread of the worker.

    def _note(self, entry: Entry, *, alive: bool) -> None:
        end = _GOAL if entry.name.endswith(_GOAL) else _STATUS
        name = self._shared.here(entry.name).removesuffix(end)
        sides = self._sides.setdefault(name, _Sides())
        if end == _GOAL:
            sides.type_name = entry.type_name
        if entry.role == "publisher":
            nodes = sides.clients if end == _GOAL else sides.servers
            (nodes.add if alive else nodes.discard)(entry.node)
        self._tries.pop(name, None)
        self._check(name)
        if not (sides.clients or sides.servers or alive):
            del self._sides[name]

    def _check(self, name: str) -> None:
        """Open the gateway of an action, or close it, as there are clients and servers."""
        sides, gateway = self._sides.get(name), self._gateways.get(name)
        if sides is None:
            return
        try:
            wanted = self._wanted(name, sides)
            if gateway is not None and wanted is not type(gateway):
                del self._gateways[name]
                gateway.close()
            if wanted is not None and name not in self._gateways:
                self._open(name, sides.type_name, wanted)
        except ClosedError:
            return  # the bridge ends
        except RoszError as error:
            self._report(name, str(error))

    def _wanted(self, name: str, sides: _Sides) -> type[_Gateway] | None:
        """Return the class of the gateway that an action needs."""
        view = self._shared.context.graph.view()
        own = {self._shared.context.session.zid}
        if self._node is not None:
            own.add(self._node.context.session.zid)

        def is_there(tokens: list[Token]) -> bool:
            return any(token.zid not in own for token in tokens)

        if not sides.type_name:
            return None
        if is_there(view.servers(f"{name}{_SEND}")):
            served = sides.servers or is_there(view.publishers(f"{name}{_STATUS}"))
            return ActionGateway if sides.clients and not served else None
        called = is_there(view.clients(f"{name}{_SEND}"))
        return ServiceGateway if sides.servers and called else None

    def _open(self, name: str, type_name: str, kind: type[_Gateway]) -> None:
        if self._node is None:
            context = Context(self._shared.context.environment)
            _, _, rest = self._shared.name.split("_", 2)
            self._node = Node(f"ros1_actions_{rest}", namespace="/", context=context)
        types = self._node.context.types
        gateway = kind(self._node, name, types.message(type_name.removesuffix("Goal")))
        if gateway.start():
            self._gateways[name] = gateway
            log.info("action '%s' crosses to servers of another protocol", name)
            return
        gateway.close()
        self._report(name, "its server has another type")

    def _report(self, name: str, reason: str) -> None:
        """Try again, since the type of a server may become known later; tell it at last."""
        tries = self._tries[name] = self._tries.get(name, 0) + 1
        if tries < _MOST_TRIES:
            self._worker.later(_RETRY_SECONDS, partial(self._check, name))
        elif tries == _MOST_TRIES:
            log.warning("action '%s' does not cross: %.300s", name, reason)
