"""Inspect a running system: what the commands list, measure, send and query.

``connect`` opens the session of a command, and ``survey`` takes a snapshot of the network;
``topics``, ``services``, ``actions``, ``nodes`` and ``definitions`` list and describe what is
there, as ROS 1's tools do. ``subscribe``, ``fields``, ``echo``, ``measure`` and ``rosout`` follow
topics; ``arguments`` and ``publish`` send messages that are written as YAML. Each module is public
and imported alone, since a command has to start fast; nothing is imported here.
"""

PUBLIC_MODULES = (
    "actions",
    "arguments",
    "connect",
    "definitions",
    "echo",
    "fields",
    "measure",
    "nodes",
    "publish",
    "rosout",
    "services",
    "subscribe",
    "survey",
    "topics",
)

__all__: tuple[str, ...] = ()
