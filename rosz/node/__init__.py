"""Nodes and their parts: publishers, subscriptions, services, clients, timers, a log.

Other packages of rosz may also import these modules directly: `clock`, `control`, `entity`, `log`,
`log_handlers`, `logger`, `service`, `signals`, `standard` and `type_description`. They serve the
ROS 1 and ROS 2 names, bags and bridges, and commands that would otherwise load more than they need.
"""

from rosz.node.client import Client
from rosz.node.context import Context
from rosz.node.control import NodeInfo
from rosz.node.decoder import MessageInfo
from rosz.node.node import Node
from rosz.node.publisher import Publisher, SubscriberLink
from rosz.node.service import Service
from rosz.node.subscription import GenericSubscription, Subscription
from rosz.node.timer import Rate, Timer, TimerEvent

__all__ = (
    "Client",
    "Context",
    "GenericSubscription",
    "MessageInfo",
    "Node",
    "NodeInfo",
    "Publisher",
    "Rate",
    "Service",
    "SubscriberLink",
    "Subscription",
    "Timer",
    "TimerEvent",
)
