"""The program ``turtlesim_node``: a simulator, with a window where there can be one."""

from __future__ import annotations

from rosz.node import Node
from rosz.node.standard import serve_loggers
from rosz.turtlesim.simulator import Simulator
from rosz.turtlesim.window import Window, WindowError

__all__ = ("main",)


def main() -> None:
    """Simulate until told to end, or until the window is closed.

    The private parameter ``headless`` does without the window.
    """
    with Node("turtlesim") as node:
        serve_loggers(node)
        node.context.cooperative = True
        simulator = Simulator(node)
        window = _window(node, simulator)
        if window is None:
            node.spin()
        else:
            window.run()


def _window(node: Node, simulator: Simulator) -> Window | None:
    """Return a window, or log why there is none."""
    reason = "the parameter ~headless is set"
    if not node.params.get("~headless", False):
        try:
            return Window(node, simulator)
        except WindowError as error:
            reason = str(error)
    node.log.info("No window: %s. 'rosz turtlesim snapshot FILE.png' takes a picture.", reason)
    return None
