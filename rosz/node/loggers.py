"""The two services by which tools of ROS 1 ask a node for its loggers and set their levels."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, NotFoundError, UsageError

if TYPE_CHECKING:
    from rosz.node.node import Node

__all__ = ("serve_loggers",)


def serve_loggers(node: Node) -> None:
    """Offer ``~get_loggers`` and ``~set_logger_level``, on a thread: nobody waits for the types."""
    threading.Thread(target=_serve, args=(node,), name="rosz-loggers", daemon=True).start()


def _serve(node: Node) -> None:
    from rosz.msgs.roscpp.msg import Logger
    from rosz.msgs.roscpp.srv import GetLoggers, SetLoggerLevel

    def get_loggers(_request: Any) -> Any:
        levels = node.log.get_levels()
        return GetLoggers.Response([Logger(name, level) for name, level in levels.items()])

    def set_level(request: Any) -> Any:
        try:
            node.log.set_level(request.logger, request.level)
        except (NotFoundError, UsageError) as error:
            # As in rospy, who asks is not told.
            node.log.warning("cannot set the level of a logger: %s", error)
        return SetLoggerLevel.Response()

    try:
        node.service("~get_loggers", GetLoggers, get_loggers)
        node.service("~set_logger_level", SetLoggerLevel, set_level)
    except ClosedError:  # a program that ends within its first moments
        return
