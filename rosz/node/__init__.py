"""Nodes and their parts: publishers, subscriptions, services, clients, actions, timers, a log.

`rosz.node.actions` is imported on its own, by users of actions; `rosz.node.ros2` has the services
that only nodes of ROS 2 have.
"""

from rosz.node.client import Client
from rosz.node.clock import Clock, TimeJump
from rosz.node.context import Context
from rosz.node.control import NodeInfo, Request, control_key
from rosz.node.decoder import MessageInfo
from rosz.node.entity import Entity
from rosz.node.local_delivery import LocalDelivery
from rosz.node.log import NodeLog, NodeLogger
from rosz.node.log_handlers import (
    ConsoleHandler,
    LogHandler,
    RosoutHandler,
    parse_severity,
    severity,
    severity_name,
)
from rosz.node.node import BridgedNode, Node
from rosz.node.publisher import Publisher, SubscriberLink
from rosz.node.service import Service
from rosz.node.signals import install as handle_signals
from rosz.node.signals import of_program
from rosz.node.standard import serve_loggers, simulate
from rosz.node.subscription import GenericSubscription, Subscription
from rosz.node.timer import Rate, Timer, TimerEvent

__all__ = (
    "BridgedNode",
    "Client",
    "Clock",
    "ConsoleHandler",
    "Context",
    "Entity",
    "GenericSubscription",
    "LocalDelivery",
    "LogHandler",
    "MessageInfo",
    "Node",
    "NodeInfo",
    "NodeLog",
    "NodeLogger",
    "Publisher",
    "Rate",
    "Request",
    "RosoutHandler",
    "Service",
    "SubscriberLink",
    "Subscription",
    "TimeJump",
    "Timer",
    "TimerEvent",
    "control_key",
    "handle_signals",
    "of_program",
    "parse_severity",
    "serve_loggers",
    "severity",
    "severity_name",
    "simulate",
)
