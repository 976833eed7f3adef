"""Euler angles in all 24 orders of axes.

An order is four letters such as ``sxyz``: ``s`` for axes that stand still or ``r`` for axes that
turn with the body, then the axes of the three turns. ROS's roll, pitch and yaw are ``sxyz``. Turns
about moving axes are those about standing ones in the reverse order, which is all that the code
here has to know about them.
"""

from __future__ import annotations

import math
from typing import Any

from rosz.errors import UsageError
from rosz.ros1.tf.transformations.quaternions import product, rotation_rows
from rosz.ros1.tf.transformations.vectors import EPSILON, Array, Numbers, numpy

__all__ = ("euler_from_matrix", "euler_from_quaternion", "euler_matrix", "quaternion_from_euler")

Axes = str | tuple[int, int, int, int]
"""An order; or, as ROS 1 also has it, first axis, parity, repetition and frame as numbers."""

_LETTERS = "xyz"
_LENGTH = 4


def _order(axes: Axes) -> tuple[tuple[int, int, int], bool]:
    """Return the axes of the turns as numbers, and whether they turn with the body."""
    if isinstance(axes, str):
        name = axes.lower()
        if len(name) == _LENGTH and name[0] in "sr" and set(name[1:]) <= set(_LETTERS):
            first, second, third = (_LETTERS.index(letter) for letter in name[1:])
            if second not in {first, third}:
                return (first, second, third), name[0] == "r"
    elif len(axes) == _LENGTH:
        inner, parity, repetition, frame = axes
        other = (inner + 1 + parity) % 3
        last = inner if repetition else 3 - inner - other
        return ((last, other, inner) if frame else (inner, other, last)), bool(frame)
    raise UsageError(
        f"'{axes}' is no order of axes; expected 's' or 'r' and three axes, such as 'sxyz'"
    )


def _turns(ai: float, aj: float, ak: float, axes: Axes) -> list[tuple[int, float]]:
    """Return the turns as axes and angles, in the order in which matrices are multiplied."""
    order, moving = _order(axes)
    turns = list(zip(order, (ai, aj, ak), strict=True))
    return turns if moving else turns[::-1]


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the rotation of three turns.

    Args:
        ai: The first angle, in radians.
        aj: The second angle.
        ak: The third angle.
        axes: Order of axes.

    Returns:
        ``[x, y, z, w]``.

    Raises:
        UsageError: There is no such order.
    """
    whole: Any = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in _turns(ai, aj, ak, axes):
        turn = [0.0, 0.0, 0.0, math.cos(angle / 2.0)]
        turn[axis] = math.sin(angle / 2.0)
        whole = product(whole, turn)
    return numpy().array(whole, dtype=float)


def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the 4x4 matrix of three turns; arguments are those of `quaternion_from_euler`.

    Raises:
        UsageError: There is no such order.
    """
    np = numpy()
    whole = np.identity(4)
    for axis, angle in _turns(ai, aj, ak, axes):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = np.identity(4)
        turn[j, j] = turn[k, k] = math.cos(angle)
        turn[k, j] = math.sin(angle)
        turn[j, k] = -turn[k, j]
        whole = whole @ turn
    return whole


def euler_from_matrix(matrix: Numbers, axes: Axes = "sxyz") -> tuple[float, float, float]:
    """Return the three angles of the rotation in a matrix, in radians.

    Where the second turn makes the axes of the others one (gimbal lock), the third angle is 0; with
    moving axes the first.

    Args:
        matrix: At least 3x3.
        axes: Order of axes.

    Raises:
        UsageError: There is no such order.
    """
    order, moving = _order(axes)
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
    """Return the three angles of a rotation, in radians; see `euler_from_matrix`.

    Args:
        quaternion: ``[x, y, z, w]``, of any length.
        axes: Order of axes.

    Raises:
        UsageError: There is no such order.
    """
    return euler_from_matrix(rotation_rows(quaternion), axes)
