"""roslaunch.scriptapi: nodes that a script starts one by one."""

from __future__ import annotations

from rosz.ros1.roslaunch.config import load_config_default
from rosz.ros1.roslaunch.core import Node, RLException
from rosz.ros1.roslaunch.parent import ROSLaunchParent
from rosz.ros1.roslaunch.pmon import Process
from rosz.ros1.roslaunch.rlutil import get_or_generate_uuid

__all__ = ("ROSLaunch",)


class ROSLaunch:
    """Starts nodes, and ends them with `stop` or with the script."""

    def __init__(self) -> None:
        self.started = False
        uuid = get_or_generate_uuid(None, options_wait_for_master=False)
        self.parent = ROSLaunchParent(uuid, [], show_summary=False)

    def load(self, f: str) -> None:
        """Read a launch file, for `start`.

        Raises:
            RLException: It is refused.
        """
        self.parent.config = load_config_default([f], None)

    def load_str(self, s: str) -> None:
        """Read the text of a launch file, for `start`.

        Raises:
            RLException: It is refused.
        """
        self.parent.config = load_config_default([], None, [s])

    def launch(self, node: Node) -> Process:
        """Start a node, and return its process.

        Raises:
            RLException: The launch has not started, or the node cannot be started.
        """
        if not self.started or self.parent.runner is None:
            raise RLException("please start ROSLaunch first")
        if not isinstance(node, Node):
            raise ValueError("arg must be of type Node")  # noqa: TRY004  # as ROS 1
        process, started = self.parent.runner.launch_node(node)
        if process is None or not started:
            why = process.get_exit_description() if process is not None else ""
            raise RLException(f"failed to launch {node.package}/{node.type}: {why}")
        return process

    def start(self) -> None:
        """Begin, with what was loaded."""
        self.parent.start(auto_terminate=False)
        self.started = True

    def spin(self) -> None:
        """Wait until the launch has ended; Ctrl-C ends it."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Return whether the launch goes on."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """End all nodes, and wait for that."""
        self.parent.shutdown()
        self.started = False
