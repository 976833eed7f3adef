"""Arithmetic of translations and rotations, in plain numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from math import acos, sin
from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""``x, y, z, w``."""

_NEARLY_ONE = 1.0 - 1e-9


class Pose(NamedTuple):
    """A rotation, followed by a translation in metres."""

    translation: Vector
    rotation: Quaternion


Step = tuple[Pose, Pose, float]
"""A pose, the next one, and how far between the two: 0 for the first, less than 1."""

_new_pose = tuple.__new__
"""Makes a pose without the checks of its class."""

IDENTITY = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


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
    return compose_steps(((inner, inner, 0.0), (outer, outer, 0.0)))


def compose_steps(steps: Iterable[Step]) -> Pose:
    """Return the pose that applies the first step first, and the last one last.

    The rotation between two poses is the smaller one of the two that are possible.
    """
    # Written out for numbers: look-ups spend most of their time here.
    x = y = z = bx = by = bz = 0.0
    bw = 1.0
    for (place, rotation), after, fraction in steps:
        px, py, pz = place
        ax, ay, az, aw = rotation
        if fraction:
            (qx, qy, qz), (cx, cy, cz, cw) = after
            px, py, pz = (
                px + (qx - px) * fraction,
                py + (qy - py) * fraction,
                pz + (qz - pz) * fraction,
            )
            cosine = ax * cx + ay * cy + az * cz + aw * cw
            if -_NEARLY_ONE <= cosine <= _NEARLY_ONE:
                angle = acos(abs(cosine))
                sine = sin(angle)
                early = sin((1.0 - fraction) * angle) / sine
                late = sin(fraction * angle) / (sine if cosine >= 0.0 else -sine)
                ax, ay = early * ax + late * cx, early * ay + late * cy
                az, aw = early * az + late * cz, early * aw + late * cw
        tx, ty, tz = 2.0 * (ay * z - az * y), 2.0 * (az * x - ax * z), 2.0 * (ax * y - ay * x)
        x, y, z = (
            px + x + aw * tx + ay * tz - az * ty,
            py + y + aw * ty + az * tx - ax * tz,
            pz + z + aw * tz + ax * ty - ay * tx,
        )
        bx, by, bz, bw = (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
    return _new_pose(Pose, ((x, y, z), (bx, by, bz, bw)))


def invert(pose: Pose) -> Pose:
    """Return the inverse of a pose."""
    x, y, z, w = pose.rotation
    back = (-x, -y, -z, w)
    tx, ty, tz = rotate(back, pose.translation)
    return Pose((-tx, -ty, -tz), back)


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
