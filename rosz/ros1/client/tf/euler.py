"""Euler angles of rotations, in plain numbers.

Euler angles exist in 24 orders of axes. An order is four letters such as ``sxyz``: ``s`` for static
axes or ``r`` for axes that rotate with the body, then the axes of the three rotations. ROS's roll,
pitch and yaw are ``sxyz``. Rotations about rotating axes are those about static axes in the reverse
order, so the code only has to reverse them.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any, TypeAlias

from rosz.errors import UsageError

Numbers: TypeAlias = Any
"""A sequence of numbers, of sequences of them, or an array."""

EPSILON = 2.0**-50
"""Numbers below this count as zero: four times the distance from 1 to the next float."""

Axes = str | tuple[int, int, int, int]
"""An order; or first axis, parity, repetition and frame as numbers, as in ROS 1."""

_ORDERS = {
    f"{frame}{'xyz'[i]}{'xyz'[j]}{'xyz'[k]}": ((i, j, k), frame == "r")
    for frame in "sr"
    for i, j, k in product(range(3), repeat=3)
    if j not in {i, k}
}


def resolve_order(axes: Axes) -> tuple[tuple[int, int, int], bool]:
    """Return the axes of the rotations as numbers, and whether they rotate with the body.

    Raises:
        UsageError: The order does not exist.
    """
    if isinstance(axes, str):
        if axes.lower() in _ORDERS:
            return _ORDERS[axes.lower()]
    elif len(axes) == 4:  # noqa: PLR2004  # as the type says
        inner, parity, repetition, frame = axes
        other = (inner + 1 + parity) % 3
        last = inner if repetition else 3 - inner - other
        return ((last, other, inner) if frame else (inner, other, last)), bool(frame)
    raise UsageError(
        f"'{axes}' is not an order of axes; expected 's' or 'r' and three axes, such as 'sxyz'"
    )


def rotation_rows(quaternion: Numbers) -> list[list[float]]:
    """Return the rows of the 3x3 rotation of a quaternion of any length."""
    x, y, z, w = (float(part) for part in quaternion)
    square = x * x + y * y + z * z + w * w
    if square < EPSILON:
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    s = 2.0 / square
    return [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]


def euler_from_matrix(matrix: Numbers, axes: Axes = "sxyz") -> tuple[float, float, float]:
    """Return the three angles of the rotation in a matrix, in radians.

    In gimbal lock, where the second rotation aligns the axes of the others, the third angle is 0;
    with rotating axes the first.

    Args:
        matrix: Matrix of at least 3x3.
        axes: Order of axes.

    Raises:
        UsageError: The order does not exist.
    """
    order, moving = resolve_order(axes)
    i, j, last = order[::-1] if moving else order
    k = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = [[float(value) for value in list(row)[:3]] for row in list(matrix)[:3]]
    if i == last:
        distance = math.hypot(m[i][j], m[i][k])
        locked = distance <= EPSILON
        first = math.atan2(m[i][j], m[i][k])
        second = math.atan2(distance, m[i][i])
        third = math.atan2(m[j][i], -m[k][i])
    else:
        distance = math.hypot(m[i][i], m[j][i])
        locked = distance <= EPSILON
        first = math.atan2(m[k][j], m[k][k])
        second = math.atan2(-m[k][i], distance)
        third = math.atan2(m[j][i], m[i][i])
    if locked:
        first, third = math.atan2(-m[j][k], m[j][j]), 0.0
    first, second, third = sign * first, sign * second, sign * third
    return (third, second, first) if moving else (first, second, third)


def euler_from_quaternion(quaternion: Numbers, axes: Axes = "sxyz") -> tuple[float, float, float]:
    """Return the angles of a rotation ``x, y, z, w`` of any length; see `euler_from_matrix`."""
    return euler_from_matrix(rotation_rows(quaternion), axes)
