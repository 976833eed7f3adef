"""Arrows, axes and lines, made of the shapes of a drawing."""

from __future__ import annotations

import math

import numpy as np

from rosz.transforms import Pose
from rosz.web.scene.drawing import Array, Drawing, color_bytes, matrix_of, placed

_HALF = math.sqrt(0.5)
_ALONG_X = (0.0, _HALF, 0.0, _HALF)
"""The rotation that turns z into x."""
_AXES = (
    ((1.0, 0.0, 0.0), "#e0483e"),
    ((0.0, 1.0, 0.0), "#3fae49"),
    ((0.0, 0.0, 1.0), "#3d74f5"),
)


def draw_arrows(
    drawing: Drawing,
    matrices: list[Array],
    colors: Array,
    *,
    length: float,
    width: float,
    head: float = 0.3,
    shaft: float = 0.0,
) -> None:
    """Draw arrows along x.

    Args:
        drawing: The drawing.
        matrices: Their poses.
        colors: Their colors.
        length: Length in metres.
        width: Diameter of the head in metres.
        head: Length of the head, as a part of the whole.
        shaft: Diameter of the shaft in metres; 0 for half of that of the head.
    """
    if not matrices:
        return
    stem = length * (1 - head)
    thick = shaft or width / 2
    rod = placed(Pose((stem / 2, 0, 0), _ALONG_X), thick, thick, stem)
    tip = placed(Pose((stem + length * head / 2, 0, 0), _ALONG_X), width, width, length * head)
    poses = np.array(matrices)
    drawing.shapes("cylinder", poses @ rod, colors)
    drawing.shapes("cone", poses @ tip, colors)


def draw_axes(drawing: Drawing, poses: list[Pose], length: float, width: float = 0.0) -> None:
    """Draw the axes of frames: x red, y green, z blue.

    Args:
        drawing: The drawing.
        poses: Poses of the frames.
        length: Length of an axis in metres.
        width: Its diameter in metres; 0 for what fits the length.
    """
    if not poses:
        return
    matrices = np.array([matrix_of(pose) for pose in poses])
    thin = width or length / 12
    for axis, color in _AXES:
        size = [length if part else thin for part in axis]
        local = np.diag((*size, 1.0))
        local[:3, 3] = np.array(axis) * length / 2
        drawing.shapes("cube", matrices @ local, color_bytes(color))


def draw_line(drawing: Drawing, points: Array, color: Array, width: float = 0.0) -> None:
    """Draw a line through points; of one pixel without a width in metres."""
    ends = np.repeat(points, 2, axis=0)[1:-1]
    if width:
        draw_bars(drawing, ends, color, width)
    else:
        drawing.lines(ends, color)


def along_directions(directions: Array) -> Array:
    """Return rotations as matrices of 3 x 3 numbers, whose x axes are directions of length 1."""
    aside = np.where(np.abs(directions[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))  # noqa: PLR2004
    second = np.cross(aside, directions)
    second /= np.linalg.norm(second, axis=1)[:, None]
    return np.stack((directions, second, np.cross(directions, second)), axis=2)


def draw_bars(drawing: Drawing, ends: Array, colors: Array, width: float) -> None:
    """Draw lines with a width in metres; every two rows are the ends of one."""
    pairs = np.asarray(ends, dtype=np.float64).reshape(-1, 2, 3)
    along = pairs[:, 1] - pairs[:, 0]
    lengths = np.linalg.norm(along, axis=1)
    positive = lengths > 0
    pairs, along, lengths = (
        pairs[positive],
        along[positive] / lengths[positive, None],
        lengths[positive],
    )
    matrices = np.zeros((len(pairs), 4, 4))
    matrices[:, :3, :3] = along_directions(along) * width
    matrices[:, :3, 0] = along * (lengths + width / 2)[:, None]
    matrices[:, :3, 3] = pairs.mean(axis=1)
    matrices[:, 3, 3] = 1.0
    paint = np.broadcast_to(colors, (len(positive), 4))[positive]
    drawing.shapes("cube", matrices, paint)
