"""The program ``turtlesim_node``: a simulator, with a window where that is possible.

The window uses Tk of the standard library, and must run on the main thread.
"""

from __future__ import annotations

from rosz.node import Node, serve_loggers
from rosz.turtlesim.picture import patches
from rosz.turtlesim.simulator import Simulator
from rosz.turtlesim.world import FIELD_PIXELS

_TITLE = "TurtleSim"
_REFRESH_MS = 33


class WindowError(Exception):
    """A window is not possible; the text tells the reason."""


class Window:
    """A window that shows a simulation; closing it shuts the node down. It needs Tk."""

    def __init__(self, node: Node, simulator: Simulator) -> None:
        try:
            import tkinter as tk
        except ImportError as error:
            raise WindowError(
                "this Python has no tkinter (Debian and Ubuntu: apt install python3-tk)"
            ) from error
        self._node = node
        self._simulator = simulator
        try:
            self._root = tk.Tk(className=_TITLE)
        except tk.TclError as error:
            raise WindowError(str(error)) from error
        self._root.title(_TITLE)
        self._root.resizable(width=False, height=False)
        self._root.protocol("WM_DELETE_WINDOW", self.close)
        self._canvas = tk.Canvas(
            self._root, width=FIELD_PIXELS, height=FIELD_PIXELS, highlightthickness=0
        )
        self._canvas.pack()
        self._image = tk.PhotoImage(master=self._root, width=FIELD_PIXELS, height=FIELD_PIXELS)
        self._canvas.create_image(0, 0, anchor="nw", image=self._image)
        self._version = -1

    def run(self) -> None:
        """Show the simulation until the node has ended."""
        self._refresh()
        self._root.mainloop()

    def close(self) -> None:
        """Shut the node down, which also closes the window."""
        self._node.shutdown("window closed")

    def _refresh(self) -> None:
        if self._node.is_shutdown:
            self._root.destroy()
            return
        self._show()
        self._root.after(_REFRESH_MS, self._refresh)

    def _show(self) -> None:
        pixels, self._version, turtles = self._simulator.view(self._version)
        if pixels is not None:
            header = f"P6 {FIELD_PIXELS} {FIELD_PIXELS} 255\n".encode()
            self._image.configure(data=header + pixels, format="ppm")
        self._canvas.delete("turtle")
        for turtle in turtles:
            for patch in patches(turtle):
                color = "#{:02x}{:02x}{:02x}".format(*patch.color)
                self._canvas.create_polygon(patch.outline, fill=color, tags="turtle")


def main() -> None:
    """Simulate until the node is shut down or the window is closed.

    With the private parameter ``headless`` there is no window.
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
    """Return a window; log the reason if there is none."""
    reason = "the parameter ~headless is set"
    if not node.params.get("~headless", False):
        try:
            return Window(node, simulator)
        except WindowError as error:
            reason = str(error)
    node.log.info("No window: %s. 'rosz turtlesim snapshot FILE.png' takes a picture.", reason)
    return None
