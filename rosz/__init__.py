"""rosz: the ROS 1 experience without a master, on Eclipse Zenoh.

>>> import rosz
>>> from rosz.msgs.std_msgs.msg import String
>>> with rosz.Node("talker") as node:
...     chatter = node.publisher("chatter", String)
...     for tick in node.rate(10):
...         chatter.publish(String(data=f"hello {tick}"))

The names are imported on first use, so that a command loads only what it needs.
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from typing import Any

    from rosz.environment import Environment
    from rosz.errors import RoszError, ServiceError, WaitTimeout
    from rosz.node import Client, Context, MessageInfo, Node, Publisher, Service, Subscription
    from rosz.qos import QoS

__all__ = (
    "Client",
    "Context",
    "Environment",
    "MessageInfo",
    "Node",
    "Publisher",
    "QoS",
    "RoszError",
    "Service",
    "ServiceError",
    "Subscription",
    "WaitTimeout",
)

_HOMES = {
    "Environment": "rosz.environment",
    "QoS": "rosz.qos",
    "RoszError": "rosz.errors",
    "ServiceError": "rosz.errors",
    "WaitTimeout": "rosz.errors",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'rosz' has no attribute '{name}'")
    import gc

    from rosz.interrupts import InterruptDeferral

    collects = gc.isenabled()
    gc.disable()  # all that is imported stays, and to look for garbage in it takes a tenth of that
    try:
        with InterruptDeferral():
            from importlib import import_module

            return getattr(import_module(_HOMES.get(name, "rosz.node")), name)
    finally:
        if collects:
            gc.enable()


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__} - {"TYPE_CHECKING", "annotations"})
