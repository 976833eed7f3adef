"""Where cameras look."""

from __future__ import annotations

from typing import Any

import numpy as np

from rosz.errors import UsageError
from rosz.transforms import Pose
from rosz.web.scene.colors import color_bytes
from rosz.web.scene.drawing import Drawing, moved
from rosz.web.scene.setup import Look

__all__ = ("draw_camera",)

_FAR = 1.0


def draw_camera(info: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw what a camera sees as a pyramid, by its CameraInfo; the size is its height.

    Raises:
        UsageError: The camera is not calibrated.
    """
    (fx, _, cx), (_, fy, cy) = (info.k[0:3], info.k[3:6])
    if not (fx and fy and info.width and info.height):
        raise UsageError("the camera is not calibrated: its k or its size is 0")
    far = look.size or _FAR
    corners = np.array(
        [
            ((u - cx) / fx * far, (v - cy) / fy * far, far)
            for u, v in ((0, 0), (info.width, 0), (info.width, info.height), (0, info.height))
        ]
    )
    ends = [
        point
        for number in range(4)
        for point in (np.zeros(3), corners[number], corners[number], corners[number - 1])
    ]
    drawing.lines(moved(np.array(ends), pose), color_bytes(look.color, "#c13c8b"))
    return f"{info.width} x {info.height}"
