"""Displays that need no messages: the grid, and the axes of one frame."""

from __future__ import annotations

import numpy as np

from rosz.transforms import IDENTITY, Pose
from rosz.web.model import Frames
from rosz.web.scene.display import Display
from rosz.web.scene.drawing import Drawing, color_bytes, moved
from rosz.web.scene.setup import AXES, GRID, Look
from rosz.web.scene.shapes import draw_axes

_GRID_CELLS = 10
_LENGTH, _RADIUS = 1.0, 0.1
"""Length and radius of axes in metres, as in rviz."""


class StillDisplay(Display):
    """A grid, or axes, at a frame.

    Args:
        look: Its settings, with the frame that it is at; the fixed frame without one.
        frames: The frames.
    """

    def __init__(self, look: Look, frames: Frames) -> None:
        kind, self._draw = STILL[look.name]
        super().__init__(look, kind)
        self._frames = frames
        self._place: Pose | None = None

    def refresh(self, fixed: str) -> bool:
        """Return whether the settings changed, or its frame moved."""
        frame = self.look.frame
        self._place, self.fault = self._frames.locate(fixed, frame) if frame else (IDENTITY, "")
        return self._shown != (self.look, self._place)

    def _draw_all(self, drawing: Drawing) -> None:
        look, place = self._shown = self.look, self._place
        if look.visible and place is not None:
            self.status = self._draw(look, place, drawing)


def draw_one_axes(look: Look, pose: Pose, drawing: Drawing) -> str:
    """Draw the axes of a frame; the size is their length in metres."""
    length, radius = look.size or _LENGTH, look.radius or _RADIUS
    draw_axes(drawing, [pose], length, 2 * radius)
    return f"at '{look.frame}'" if look.frame else "at the fixed frame"


def draw_grid(look: Look, pose: Pose, drawing: Drawing) -> str:
    """Draw a grid on the plane z = 0 of a frame; its size is that of a cell."""
    size = look.size or 1.0
    cells = look.cells or _GRID_CELLS
    reach = cells * size / 2
    at = np.linspace(-reach, reach, cells + 1)
    edge = np.full_like(at, reach)
    zero = np.zeros_like(at)
    ends = np.concatenate(
        [
            np.stack([np.column_stack((at, -edge, zero)), np.column_stack((at, edge, zero))], 1),
            np.stack([np.column_stack((-edge, at, zero)), np.column_stack((edge, at, zero))], 1),
        ]
    )
    drawing.lines(moved(ends.reshape(-1, 3), pose), color_bytes(look.color, "#8a94a6"))
    return f"{cells} x {cells} cells of {size:g} m"


STILL = {GRID: ("Grid", draw_grid), AXES: ("Axes", draw_one_axes)}
"""The kinds of these displays, and what draws them, by their names."""
