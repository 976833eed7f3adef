"""The live graph and the parameters of this process, for what asks without being a node."""

from __future__ import annotations

from typing import Any

from rosz.introspect.survey import Survey
from rosz.node import Context, Node
from rosz.params.api import Params
from rosz.wire import Token

__all__ = ("address", "context", "nameless_node", "params", "survey")

_SETTLED_BY = 2.0


def context() -> Context:
    """Return the context of this process, opened if need be.

    Raises:
        TransportError: It cannot be opened.
    """
    from rosz.ros1.rospy import state

    opened: Context = state.context()
    opened.settled.wait(_SETTLED_BY)
    return opened


def survey() -> Survey:
    """Look at who is there, now.

    Raises:
        TransportError: The session cannot be opened.
        WaitTimeout: The network does not answer.
    """
    here = context()
    view = here.graph.refresh()
    return Survey(here.domain, view, {(p.zid, p.node_id): p for p in view.processes()})


def params(node: str) -> Params:
    """Return the parameters as a node of that full name sees them."""
    return Params(context().params, node)


def address(found: Survey, token: Token) -> str:
    """Return an address of a node, with its host where it tells it.

    ROS 1 has the address of its XML-RPC server there. Nothing answers at this one.
    """
    process = found.process(token)
    host = "unknown" if process is None else process.host
    return f"rosz://{host}/{token.zid}/{token.node_id}"


def nameless_node(name: str) -> Any:
    """Return this process's node, or, before ``init_node``, an anonymous one to be closed.

    Returns:
        A context manager that gives the node.
    """
    from contextlib import nullcontext

    from rosz.ros1.rospy import state

    if state.has_node():
        return nullcontext(state.node())
    return Node(name, anonymous=True, context=context())
