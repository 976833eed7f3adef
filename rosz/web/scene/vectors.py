"""Vectors at a frame: forces, speeds and accelerations; and what inertial sensors measure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rosz.transforms import Pose, compose
from rosz.web.scene.colors import color_bytes
from rosz.web.scene.drawing import Drawing, moved
from rosz.web.scene.poses import rotation_from
from rosz.web.scene.setup import Look
from rosz.web.scene.shapes import draw_axes, draw_line

__all__ = ("draw_accel", "draw_imu", "draw_twist", "draw_wrench")

_LENGTH = 1.0
_TURNING = "#c9a227"


def draw_wrench(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a WrenchStamped: its force, and its torque in another color."""
    wrench = message.wrench
    return _draw_two(("force", wrench.force), ("torque", wrench.torque), pose, look, drawing)


def draw_twist(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a TwistStamped: its linear part, and its angular one in another color."""
    twist = message.twist
    return _draw_two(("linear", twist.linear), ("angular", twist.angular), pose, look, drawing)


def draw_accel(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw an AccelStamped: its linear part, and its angular one in another color."""
    accel = message.accel
    return _draw_two(("linear", accel.linear), ("angular", accel.angular), pose, look, drawing)


def draw_imu(message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw an Imu: the axes of its orientation, if it knows one, and its acceleration."""
    if message.orientation_covariance[0] >= 0:
        turned = Pose((0.0, 0.0, 0.0), rotation_from(message.orientation))
        draw_axes(drawing, [compose(pose, turned)], look.size or _LENGTH)
    return _draw_one("acceleration", message.linear_acceleration, pose, look, drawing, "#cc3333")


def _draw_two(
    first: tuple[str, Any], second: tuple[str, Any], pose: Pose, look: Look, drawing: Drawing
) -> str:
    return ", ".join(
        _draw_one(name, vector, pose, look, drawing, color)
        for (name, vector), color in ((first, look.color or "#cc3333"), (second, _TURNING))
    )


def _draw_one(name: str, vector: Any, pose: Pose, look: Look, drawing: Drawing, color: str) -> str:
    size = look.size or _LENGTH
    ends = moved(np.array([(0.0, 0.0, 0.0), (vector.x, vector.y, vector.z)]) * size, pose)
    draw_line(drawing, ends, color_bytes(color), size / 20)
    return f"{name} {math.hypot(vector.x, vector.y, vector.z):.2f}"
