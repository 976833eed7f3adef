"""Arithmetic of translations and rotations, in plain numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ("IDENTITY", "Pose", "Quaternion", "Vector", "compose", "interpolate", "invert", "rotate")

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""``x, y, z, w``."""

_NEARLY_ONE = 1.0 - 1e-9


class Pose(NamedTuple):
    """A rotation, followed by a translation in metres."""

    translation: Vector
    rotation: Quaternion


IDENTITY = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def _multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    # With t = 2 q x v the result is v + w t + q x t: half the products of two quaternions.
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def compose(outer: Pose, inner: Pose) -> Pose:
    """Return the pose that applies the inner one first, then the outer one."""
    ox, oy, oz = outer.translation
    ix, iy, iz = rotate(outer.rotation, inner.translation)
    return Pose((ox + ix, oy + iy, oz + iz), _multiply(outer.rotation, inner.rotation))


def invert(pose: Pose) -> Pose:
    """Return the inverse of a pose."""
    x, y, z, w = pose.rotation
    back = (-x, -y, -z, w)
    tx, ty, tz = rotate(back, pose.translation)
    return Pose((-tx, -ty, -tz), back)


def interpolate(before: Pose, after: Pose, fraction: float) -> Pose:
    """Interpolate between two poses, by the smaller of the two rotations.

    Args:
        before: Pose at fraction 0.
        after: Pose at fraction 1.
        fraction: Position between the two.
    """
    (ax, ay, az), (bx, by, bz) = before.translation, after.translation
    middle = (ax + (bx - ax) * fraction, ay + (by - ay) * fraction, az + (bz - az) * fraction)
    one, two = before.rotation, after.rotation
    cosine = sum(p * q for p, q in zip(one, two, strict=True))
    sign = 1.0 if cosine >= 0.0 else -1.0
    if abs(cosine) > _NEARLY_ONE:
        return Pose(middle, one)
    angle = math.acos(abs(cosine))
    early = math.sin((1.0 - fraction) * angle) / math.sin(angle)
    late = sign * math.sin(fraction * angle) / math.sin(angle)
    x, y, z, w = (early * p + late * q for p, q in zip(one, two, strict=True))
    return Pose(middle, (x, y, z, w))
