"""A window on the field, by Tk of the standard library. It belongs to the main thread."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosz.turtlesim.shape import looks
from rosz.turtlesim.turtle import FIELD_PIXELS

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.turtlesim.simulator import Simulator

__all__ = ("Window", "WindowError")

_TITLE = "TurtleSim"
_REFRESH_MS = 33


class WindowError(Exception):
    """There can be no window; the text says why."""


class Window:
    """A window that shows a simulation until it is closed or the node ends.

    Args:
        node: Ends when the window is closed.
        simulator: What it shows.

    Raises:
        WindowError: There is no display, or Python has been built without Tk.
    """

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
        """Show what happens; returns when the node has ended."""
        self._refresh()
        self._root.mainloop()

    def close(self) -> None:
        """End the node, and the window with it."""
        self._node.shutdown("window closed")

    def _refresh(self) -> None:
        if self._node.is_shutdown:
            self._root.destroy()
            return
        self._show()
        self._root.after(_REFRESH_MS, self._refresh)

    def _show(self) -> None:
        view = self._simulator.view(self._version)
        if view.pixels is not None:
            header = f"P6 {FIELD_PIXELS} {FIELD_PIXELS} 255\n".encode()
            self._image.configure(data=header + view.pixels, format="ppm")
            self._version = view.version
        self._canvas.delete("turtle")
        for turtle in view.turtles:
            for patch in looks(turtle):
                color = "#{:02x}{:02x}{:02x}".format(*patch.color)
                self._canvas.create_polygon(patch.outline, fill=color, tags="turtle")
