"""Gateways for actions whose client and server support different protocols.

actionlib's clients in C++ support only the protocol of topics; most servers of ROS 2 support only
that of services. A gateway translates between such a client and such a server. It has its own node
and session, since ROS 1 does not see the entities of the bridge's session. Programs that support
both protocols need no gateway.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import msgspec

from rosz.actions import SEND, ServiceGateway, TopicGateway
from rosz.bridges.ros1.registry import RegistryEntry
from rosz.bridges.ros1.shared import BRIDGE, MASTER_NODE, BridgeResources
from rosz.bridges.ros1.sockets import log
from rosz.errors import ClosedError, RoszError
from rosz.node import Context, Node
from rosz.wire import Token
from rosz.worker import Worker

_GOAL = "/goal"
_GOAL_TYPE = "ActionGoal"
_STATUS = "/status"
_STATUS_TYPE = "actionlib_msgs/GoalStatusArray"
_SEND = f"/{SEND}"
_RETRY_SECONDS = 1.0
_MOST_TRIES = 5

_Gateway = TopicGateway | ServiceGateway


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


class ActionGateways:
    """Opens gateways for actions, and closes a gateway when its client or server has ended."""

    def __init__(self, shared: BridgeResources) -> None:
        self._shared = shared
        self._sides: dict[str, _Sides] = {}
        self._gateways: dict[str, _Gateway] = {}
        self._node: Node | None = None
        self._tries: dict[str, int] = {}
        self._worker: Worker[Callable[[], object]] = Worker("rosz-ros1-actions", logger=log)

    def change(self, entry: RegistryEntry, *, alive: bool) -> None:
        """Handle a registration of ROS 1 that was added or removed."""
        is_goal = entry.name.endswith(_GOAL) and entry.type_name.endswith(_GOAL_TYPE)
        is_status = entry.name.endswith(_STATUS) and entry.type_name == _STATUS_TYPE
        if (is_goal or is_status) and not entry.node.startswith((BRIDGE, MASTER_NODE)):
            self._worker.submit(partial(self._note, entry, alive=alive))

    def update(self, name: str) -> None:
        """Handle a change of the entities of a topic or service on the network."""
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

    # The following methods run on the thread of the worker.

    def _note(self, entry: RegistryEntry, *, alive: bool) -> None:
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
        """Open or close the gateway of an action, depending on its clients and servers."""
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
            return  # the bridge is being closed
        except RoszError as error:
            self._report(name, str(error))

    def _wanted(self, name: str, sides: _Sides) -> type[_Gateway] | None:
        """Return the class of the gateway that an action needs; None if it needs none."""
        view = self._shared.context.graph.view()
        own = {self._shared.context.session.zid}
        if self._node is not None:
            own.add(self._node.context.session.zid)

        def has_other(tokens: list[Token]) -> bool:
            return any(token.zid not in own for token in tokens)

        if not sides.type_name:
            return None
        if has_other(view.servers(f"{name}{_SEND}")):
            served = sides.servers or has_other(view.publishers(f"{name}{_STATUS}"))
            return TopicGateway if sides.clients and not served else None
        called = has_other(view.clients(f"{name}{_SEND}"))
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
            log.info("opened a gateway for action '%s' between both protocols", name)
            return
        gateway.close()
        self._report(name, "its server has another type")

    def _report(self, name: str, reason: str) -> None:
        """Check again later, since a type may become known; log the reason after the last try."""
        tries = self._tries[name] = self._tries.get(name, 0) + 1
        if tries < _MOST_TRIES:
            self._worker.later(_RETRY_SECONDS, partial(self._check, name))
        elif tries == _MOST_TRIES:
            log.warning("cannot open a gateway for action '%s': %.300s", name, reason)
