"""Nodes and their parts: publishers, subscriptions, services, clients, actions, timers, a log.

`action_server`, `action_client`, `action_watch` and `goals` are imported on their own, by what uses
actions, and so are `type_description`, `ros2_parameters` and `ros2_values`, by what needs
definitions of other nodes, or parameters in the form of ROS 2.
"""

from rosz.node.bridged import BridgedNode
from rosz.node.client import Client
from rosz.node.clock import Clock
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
from rosz.node.node import Node
from rosz.node.publisher import Publisher, SubscriberLink
from rosz.node.service import Service
from rosz.node.signals import install as handle_signals
from rosz.node.signals import of_program
from rosz.node.standard import serve_loggers, simulate
from rosz.node.subscription import GenericSubscription, Subscription
from rosz.node.timer import Rate, Timer, TimerEvent

PUBLIC_MODULES = (
    "action_client",
    "action_server",
    "action_watch",
    "goals",
    "ros2_parameters",
    "ros2_values",
    "type_description",
)

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
