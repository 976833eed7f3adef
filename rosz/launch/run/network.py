"""What a launch needs of the network, and how a context provides it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.launch.plan.model import Condition
from rosz.launch.run.hub import Hub
from rosz.launch.run.parameters import ParamStore
from rosz.launch.run.process import Readiness
from rosz.params import DELETED, Change, condense, normalise, split
from rosz.session import Session

if TYPE_CHECKING:
    from rosz.graph import Graph
    from rosz.node.context import Context
    from rosz.params.replica import Replica

__all__ = ("GraphReadiness", "Network", "ReplicaStore")


class Network(msgspec.Struct, frozen=True, kw_only=True):
    """What a launch needs of the network.

    Attributes:
        store: The parameters.
        readiness: What nodes may wait for.
        session: Where it answers for itself; None to answer nobody.
        domain: The ROS domain.
        alone: Whether nobody else holds the parameters.
        hub: The core that the nodes are clients of; None where they form a mesh.
    """

    store: ParamStore
    readiness: Readiness
    session: Session | None = None
    domain: int = 0
    alone: bool = True
    hub: Hub | None = None

    @classmethod
    def of(cls, context: Context, hub: Hub | None = None) -> Network:
        """Return the network of a context.

        Args:
            context: The context of the launch process.
            hub: The core that was started for it.
        """
        replica = context.params
        store = ReplicaStore(replica)
        return cls(
            store=store,
            readiness=GraphReadiness(context.graph, store),
            session=context.session,
            domain=context.domain,
            alone=not replica.members(),
            hub=hub,
        )


class GraphReadiness:
    """Conditions, looked up in the live graph and the parameters.

    Args:
        graph: Who is alive.
        store: The parameters.
    """

    def __init__(self, graph: Graph, store: ParamStore) -> None:
        self._graph = graph
        self._store = store

    def holds(self, condition: Condition) -> bool:
        """Tell whether something is so by now."""
        if condition.kind == "param":
            return self._store.has(condition.name)
        view = self._graph.view()
        if condition.kind == "topic":
            return bool(view.publishers(condition.name))
        if condition.kind == "service":
            return bool(view.servers(condition.name))
        return condition.name in view.nodes()


class ReplicaStore:
    """The parameters, in a replica of this process, which the launch thereby keeps alive.

    Args:
        replica: The replica.
    """

    def __init__(self, replica: Replica) -> None:
        self._replica = replica

    def get(self, name: str) -> Any:
        """Return the value of a global name.

        Raises:
            ParamNotFound: It is not set.
        """
        return self._replica.peek(name)

    def has(self, name: str) -> bool:
        """Tell whether a global name is set."""
        return self._replica.has(name)

    def write(self, values: Mapping[str, Any], deleted: Iterable[str] = ()) -> None:
        """Delete some names, then set some, as one change.

        Raises:
            ParamError: A value is not acceptable; nothing has changed then.
        """
        changes: list[Change] = []
        for name in deleted:
            path = split(name)
            if not path:
                changes.append((path, {}))
            elif self._replica.has(name):
                changes.append((path, DELETED))
        changes += [(split(name), normalise(value, name)) for name, value in values.items()]
        self._replica.write(condense(changes))

    def dump(self, name: str) -> str:
        """Return the subtree at a global name as YAML.

        Raises:
            ParamNotFound: It is not set.
        """
        from rosz.params.yaml import dump

        return dump(self._replica.peek(name))
