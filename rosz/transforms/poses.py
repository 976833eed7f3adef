"""Arithmetic of translations and rotations, in plain numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

__all__ = (
    "IDENTITY",
    "Pose",
    "Quaternion",
    "Vector",
    "compose",
    "describe_pose",
    "from_rpy",
    "interpolate",
    "invert",
    "rotate",
    "to_rpy",
)

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


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about the fixed axes x, y and z, in this order; angles in radians."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def to_rpy(rotation: Quaternion) -> tuple[float, float, float]:
    """Return the angles about the fixed axes x, y and z, in radians.

    Where the pitch is a right angle, only the sum of roll and yaw is known, and the yaw is 0.
    """
    x, y, z, w = rotation
    sine = 2.0 * (w * y - z * x)
    if abs(sine) >= _NEARLY_ONE:
        return (2.0 * math.atan2(x, w), math.copysign(math.pi / 2, sine), 0.0)
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, math.asin(sine), yaw


def describe_pose(pose: Pose, stamp: int, precision: int = 3) -> list[str]:
    """Return the lines that tf_echo prints about a pose.

    Args:
        pose: The pose.
        stamp: Its time in nanoseconds.
        precision: Number of digits behind the point.
    """

    def listed(numbers: Iterable[float]) -> str:
        return f"[{', '.join(f'{number:.{precision}f}' for number in numbers)}]"

    angles = to_rpy(pose.rotation)
    return [
        f"At time {stamp / 1e9:.{precision}f}",
        f"- Translation: {listed(pose.translation)}",
        f"- Rotation: in Quaternion {listed(pose.rotation)}",
        f"            in RPY (radian) {listed(angles)}",
        f"            in RPY (degree) {listed(map(math.degrees, angles))}",
    ]
