"""Vectors, quaternions and Euler angles.

Quaternions are ``[x, y, z, w]``. numpy is imported when the first result needs it.

Euler angles exist in 24 orders of axes. An order is four letters such as ``sxyz``: ``s`` for static
axes or ``r`` for axes that rotate with the body, then the axes of the three rotations. ROS's roll,
pitch and yaw are ``sxyz``. Rotations about rotating axes are those about static axes in the reverse
order, which is all that the code here has to know about them.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from rosz.errors import UsageError

__all__ = (
    "EPSILON",
    "Array",
    "Numbers",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_matrix",
    "numpy",
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "random_vector",
    "unit_vector",
    "vector_norm",
)

Array: TypeAlias = Any
"""A numpy array of floats."""

Numbers: TypeAlias = Any
"""A sequence of numbers, of sequences of them, or an array."""

EPSILON = 2.0**-50
"""Numbers below this count as zero: four times the distance from 1 to the next float."""


def numpy() -> Any:
    """Return numpy.

    Raises:
        ModuleNotFoundError: numpy is not installed; the text says how to install it.
    """
    try:
        import numpy as np
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "tf.transformations returns numpy arrays, and numpy is not installed; run:"
            " pip install 'rosz[numpy]'",
            name=error.name,
        ) from error
    return np


def vector_norm(data: Numbers, axis: int | None = None, out: Array = None) -> Any:
    """Return the length of a vector, or an array of lengths.

    Args:
        data: The vector, or an array of several.
        axis: Axis of the vectors; the whole array is one vector when not given.
        out: Array for the lengths; nothing is returned then.
    """
    np = numpy()
    values = np.array(data, dtype=float)
    lengths = np.sqrt(np.sum(np.square(values), axis=axis))
    if out is None:
        return lengths if values.ndim == 1 else np.atleast_1d(lengths)
    out[...] = lengths
    return None


def unit_vector(data: Numbers, axis: int | None = None, out: Array = None) -> Array:
    """Return a vector of the same direction and of length 1, or several along an axis.

    Args:
        data: The vector or array.
        axis: Axis of the vectors; the whole array is one vector when not given.
        out: Array for the result; nothing is returned then.
    """
    np = numpy()
    values = np.array(data, dtype=float)
    lengths = np.sqrt(np.sum(np.square(values), axis=axis, keepdims=axis is not None))
    with np.errstate(invalid="ignore", divide="ignore"):
        values = values / lengths
    if out is None:
        return values
    out[...] = values
    return None


def random_vector(size: int) -> Array:
    """Return random numbers from 0, included, to 1, excluded."""
    return numpy().random.random(size)


Four = tuple[float, float, float, float]


def _product(left: Numbers, right: Numbers) -> Four:
    """Return the Hamilton product of two quaternions as plain numbers."""
    ax, ay, az, aw = left
    bx, by, bz, bw = right
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _rotation_rows(quaternion: Numbers) -> list[list[float]]:
    """Return the 3x3 rotation of a quaternion of any length as plain numbers."""
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


def quaternion_multiply(quaternion1: Numbers, quaternion0: Numbers) -> Array:
    """Return the rotation that applies the second one first, then the first one."""
    return numpy().array(_product(quaternion1, quaternion0), dtype=float)


def quaternion_conjugate(quaternion: Numbers) -> Array:
    """Return the quaternion with its vector part negated."""
    x, y, z, w = quaternion
    return numpy().array((-x, -y, -z, w), dtype=float)


def quaternion_inverse(quaternion: Numbers) -> Array:
    """Return the inverse of a quaternion of any length."""
    conjugate = quaternion_conjugate(quaternion)
    return conjugate / conjugate.dot(conjugate)


def quaternion_about_axis(angle: float, axis: Numbers) -> Array:
    """Return the rotation by an angle about an axis of any length."""
    x, y, z = (float(part) for part in tuple(axis)[:3])
    length = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(angle / 2.0) / length if length > EPSILON else 1.0
    return numpy().array((x * scale, y * scale, z * scale, math.cos(angle / 2.0)), dtype=float)


def quaternion_matrix(quaternion: Numbers) -> Array:
    """Return the 4x4 matrix of a rotation."""
    np = numpy()
    matrix = np.identity(4)
    matrix[:3, :3] = _rotation_rows(quaternion)
    return matrix


def quaternion_from_matrix(matrix: Numbers) -> Array:
    """Return the rotation of a 4x4 matrix, calculated from its largest part."""
    np = numpy()
    m = np.array(matrix, dtype=float)[:4, :4]
    corner = m[3, 3]
    trace = m.trace()
    quaternion = np.empty(4)
    if trace > corner:
        largest = trace
        quaternion[:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], largest
    else:
        i = 1 if m[1, 1] > m[0, 0] else 0
        i = 2 if m[2, 2] > m[i, i] else i
        j, k = (i + 1) % 3, (i + 2) % 3
        largest = m[i, i] - (m[j, j] + m[k, k]) + corner
        quaternion[i] = largest
        quaternion[j] = m[i, j] + m[j, i]
        quaternion[k] = m[k, i] + m[i, k]
        quaternion[3] = m[k, j] - m[j, k]
    return quaternion * (0.5 / math.sqrt(largest * corner))


def quaternion_slerp(
    quat0: Numbers, quat1: Numbers, fraction: float, spin: int = 0, shortestpath: bool = True
) -> Array:
    """Interpolate between two rotations at constant angular speed.

    Args:
        quat0: The rotation at fraction 0.
        quat1: The rotation at fraction 1.
        fraction: Position between the two.
        spin: Additional half turns.
        shortestpath: Whether to rotate by the smaller of the two angles.
    """
    start, end = unit_vector(tuple(quat0)[:4]), unit_vector(tuple(quat1)[:4])
    if fraction == 0.0:
        return start
    if fraction == 1.0:
        return end
    cosine = float(start.dot(end))
    if abs(abs(cosine) - 1.0) < EPSILON:
        return start
    if shortestpath and cosine < 0.0:
        cosine, end = -cosine, -end
    angle = math.acos(cosine) + spin * math.pi
    if abs(angle) < EPSILON:
        return start
    early, late = math.sin((1.0 - fraction) * angle), math.sin(fraction * angle)
    return (start * early + end * late) / math.sin(angle)


def random_quaternion(rand: Numbers = None) -> Array:
    """Return a random rotation of uniform distribution (Shoemake, Graphics Gems III).

    Args:
        rand: Three numbers from 0 to 1; random when not given.
    """
    np = numpy()
    one, two, three = np.random.random(3) if rand is None else rand
    low, high = math.sqrt(1.0 - one), math.sqrt(one)
    first, second = 2.0 * math.pi * two, 2.0 * math.pi * three
    return np.array(
        (
            math.sin(first) * low,
            math.cos(first) * low,
            math.sin(second) * high,
            math.cos(second) * high,
        )
    )


Axes = str | tuple[int, int, int, int]
"""An order; or first axis, parity, repetition and frame as numbers, as in ROS 1."""

_LETTERS = "xyz"
_LENGTH = 4


def _order(axes: Axes) -> tuple[tuple[int, int, int], bool]:
    """Return the axes of the rotations as numbers, and whether they rotate with the body."""
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
        f"'{axes}' is not an order of axes; expected 's' or 'r' and three axes, such as 'sxyz'"
    )


def _rotations(ai: float, aj: float, ak: float, axes: Axes) -> list[tuple[int, float]]:
    """Return the rotations as axes and angles, in the order in which matrices are multiplied."""
    order, moving = _order(axes)
    turns = list(zip(order, (ai, aj, ak), strict=True))
    return turns if moving else turns[::-1]


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the rotation of three Euler angles.

    Args:
        ai: First angle in radians.
        aj: Second angle in radians.
        ak: Third angle in radians.
        axes: Order of axes.

    Returns:
        ``[x, y, z, w]``.

    Raises:
        UsageError: There is no such order.
    """
    whole: Any = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in _rotations(ai, aj, ak, axes):
        turn = [0.0, 0.0, 0.0, math.cos(angle / 2.0)]
        turn[axis] = math.sin(angle / 2.0)
        whole = _product(whole, turn)
    return numpy().array(whole, dtype=float)


def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the 4x4 matrix of three Euler angles; see `quaternion_from_euler`.

    Raises:
        UsageError: There is no such order.
    """
    np = numpy()
    whole = np.identity(4)
    for axis, angle in _rotations(ai, aj, ak, axes):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = np.identity(4)
        turn[j, j] = turn[k, k] = math.cos(angle)
        turn[k, j] = math.sin(angle)
        turn[j, k] = -turn[k, j]
        whole = whole @ turn
    return whole


def euler_from_matrix(matrix: Numbers, axes: Axes = "sxyz") -> tuple[float, float, float]:
    """Return the three angles of the rotation in a matrix, in radians.

    In gimbal lock, where the second rotation aligns the axes of the others, the third angle is 0;
    with rotating axes the first.

    Args:
        matrix: Matrix of at least 3x3.
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
    return euler_from_matrix(_rotation_rows(quaternion), axes)
