"""What a launch needs of the network, and how a context provides it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from rosz.launch.plan.model import Condition
from rosz.launch.run.parameters import ParamStore
from rosz.launch.run.process import Readiness
from rosz.session import Session

if TYPE_CHECKING:
    from rosz.graph import Graph
    from rosz.node.context import Context

__all__ = ("GraphReadiness", "Network")


class Network(msgspec.Struct, frozen=True, kw_only=True):
    """What a launch needs of the network.

    Attributes:
        store: The parameters.
        readiness: What nodes may wait for.
        session: Where it answers for itself; None to answer nobody.
        domain: The ROS domain.
        alone: Whether nobody else holds the parameters.
    """

    store: ParamStore
    readiness: Readiness
    session: Session | None = None
    domain: int = 0
    alone: bool = True

    @classmethod
    def of(cls, context: Context) -> Network:
        """Return the network of a context.

        Args:
            context: The context of the launch process.
        """
        store = ReplicaStore(context.params)
        return cls(
            store=store,
            readiness=GraphReadiness(context.graph, store),
            session=context.session,
            domain=context.domain,
            alone=not context.session.peers(),
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
