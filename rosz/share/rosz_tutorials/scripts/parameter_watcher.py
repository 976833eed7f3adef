#!/usr/bin/env python3
"""Log the node's private parameters, and every change of them."""

import rosz
from rosz.params.replica import Changed

with rosz.Node("parameter_watcher") as node:
    # Names are resolved as in ROS 1. For a node called /robot/watcher, robot_name is
    # /robot/robot_name, and ~speed is /robot/watcher/speed.
    node.log.info("%s is ready", node.params.get("robot_name", "a robot without a name"))
    for name, value in sorted(node.params.get("~", {}).items()):
        node.log.info("%s is %r", name, value)

    def on_change(change: Changed) -> None:
        """Log one change."""
        node.log.info("%s changed from %r to %r", change.name, change.old, change.new)

    node.params.watch("~", on_change)
    node.spin()
