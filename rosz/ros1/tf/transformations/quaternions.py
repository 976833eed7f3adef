"""Quaternions ``[x, y, z, w]``."""

from __future__ import annotations

import math

from rosz.ros1.tf.transformations.vectors import EPSILON, Array, Numbers, numpy, unit_vector

__all__ = (
    "product",
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "rotation_rows",
)

Four = tuple[float, float, float, float]


def product(left: Numbers, right: Numbers) -> Four:
    """Return the Hamilton product of two quaternions as plain numbers."""
    ax, ay, az, aw = left
    bx, by, bz, bw = right
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotation_rows(quaternion: Numbers) -> list[list[float]]:
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
    """Return the rotation that first does the second one, then the first one."""
    return numpy().array(product(quaternion1, quaternion0), dtype=float)


def quaternion_conjugate(quaternion: Numbers) -> Array:
    """Return the quaternion with its vector part turned round."""
    x, y, z, w = quaternion
    return numpy().array((-x, -y, -z, w), dtype=float)


def quaternion_inverse(quaternion: Numbers) -> Array:
    """Return the quaternion that undoes one, of any length."""
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
    matrix[:3, :3] = rotation_rows(quaternion)
    return matrix


def quaternion_from_matrix(matrix: Numbers) -> Array:
    """Return the rotation of a 4x4 matrix, from whichever part is the largest."""
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
    """Return a rotation on the way from one to another, at constant speed.

    Args:
        quat0: The rotation at fraction 0.
        quat1: The rotation at fraction 1.
        fraction: How far along the way.
        spin: Additional half turns.
        shortestpath: Whether to take the shorter of the two ways round.
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
    """Return a rotation such that all are equally likely (Shoemake, Graphics Gems III).

    Args:
        rand: Three numbers from 0 to 1 to make it of; drawn when not given.
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
