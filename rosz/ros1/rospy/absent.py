"""What rospy has and rosz cannot have, said by name instead of left to a bare AttributeError."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from rosz.errors import near_miss

__all__ = ("attribute",)

_PREFIX = "rosz.ros1."
_NO_MASTER = (
    "there is no master and no XML-RPC here; rospy.get_master() answers what a master would"
)
_NO_TCPROS = "messages travel over Zenoh, not TCPROS; use rospy.Publisher and rospy.Subscriber"
_REASONS = {
    "get_registration_listeners": _NO_MASTER,
    "get_service_manager": _NO_MASTER,
    "get_tcpros_handler": _NO_TCPROS,
    "get_tcpros_server_address": _NO_TCPROS,
    "get_topic_manager": _NO_TCPROS,
    "init_tcpros": _NO_TCPROS,
    "QueuedConnection": _NO_TCPROS,
    "set_node_uri": _NO_MASTER,
    "set_service_manager": _NO_MASTER,
    "set_topic_manager": _NO_TCPROS,
    "start_node": "use rospy.init_node()",
    "TCPROSHandler": _NO_TCPROS,
    "TCPROSTransport": _NO_TCPROS,
    "xmlrpcapi": _NO_MASTER,
    "xmlrpcclient": _NO_MASTER,
}


def attribute(module: str, homes: Mapping[str, str] | None = None) -> Callable[[str], Any]:
    """Make the ``__getattr__`` of a module.

    Args:
        module: Its name.
        homes: Names that it offers, too, with the module that each one is loaded from when it is
            first asked for.

    Returns:
        A function that loads such a name, or raises an AttributeError that names the attribute and
        says why it is not there or what comes near it.
    """
    shown = module.removeprefix(_PREFIX)
    places = homes or {}

    def get(name: str) -> Any:
        loaded = import_module(module)
        if name in places:
            home = import_module(places[name])
            value = home if home.__name__.endswith(f".{name}") else getattr(home, name)
            setattr(loaded, name, value)
            return value
        text = f"module '{shown}' of rosz has no attribute '{name}'"
        reason = _REASONS.get(name)
        if reason is None and not name.startswith("_"):
            reason = near_miss(name, [n for n in vars(loaded) if not n.startswith("_")])
            reason = reason.removeprefix("; ")
        raise AttributeError(f"{text}; {reason}" if reason else text, name=name, obj=loaded)

    return get
