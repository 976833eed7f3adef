"""Nodes and all that they declare: publishers, subscriptions, services, clients, timers, a log."""

from rosz.node.channel import MessageInfo
from rosz.node.client import Client
from rosz.node.context import Context
from rosz.node.control import NodeInfo
from rosz.node.generic import GenericSubscription
from rosz.node.node import Node
from rosz.node.publisher import Publisher, SubscriberLink
from rosz.node.rate import Rate
from rosz.node.service import Service
from rosz.node.subscription import Subscription
from rosz.node.timer import Timer, TimerEvent

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
