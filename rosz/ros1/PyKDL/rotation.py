"""PyKDL: rotations."""

# ruff: noqa: N802  # KDL's names

from __future__ import annotations

import math
from operator import itemgetter
from typing import Any, Self

from rosz.ros1.PyKDL.linear import Twist, Vector, Wrench
from rosz.ros1.PyKDL.values import (
    EPSILON,
    NEARLY_ZERO,
    Linear,
    Value,
    checked,
    number,
    over,
    root,
    sin_cos,
    text,
)

__all__ = ("Rotation",)

_ENTRIES = ("xx", "yx", "zx", "xy", "yy", "zy", "xz", "yz", "zz")


class Rotation(Value):
    """A rotation matrix.

    Args:
        numbers: Nothing for the identity, a rotation to copy, three columns as vectors, or nine
            numbers, row by row.
        named: Columns ``x``, ``y``, ``z``, or numbers ``xx``, ``yx``, ``zx``, ``xy`` …, by name.
    """

    kind = "Rotation"

    def __init__(self, *numbers: Any, **named: Any) -> None:
        order = ("x", "y", "z") if "z" in named else _ENTRIES
        if unknown := set(named) - set(order[len(numbers) :]):
            raise TypeError(f"unexpected arguments: {', '.join(sorted(unknown))}")
        given = [*numbers, *(named[name] for name in order if name in named)]
        if not given:
            self.numbers = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        elif len(given) == 1 and isinstance(given[0], Rotation):
            self.numbers = list(given[0].numbers)
        elif len(given) == 3:  # noqa: PLR2004  # columns
            columns = [checked(one, Vector).numbers for one in given]
            self.numbers = [column[row] for row in range(3) for column in columns]
        elif len(given) == 9:  # noqa: PLR2004  # the whole matrix
            self.numbers = [number(one) for one in given]
        else:
            raise TypeError(f"expected a Rotation, three Vectors or nine numbers, got {given}")

    def copied(self) -> Self:  # noqa: D102
        return Rotation(self)  # type: ignore[return-value]  # also of a derived class, as KDL

    def __getstate__(self) -> tuple[float, float, float]:
        return self.GetRPY()

    def __setstate__(self, state: tuple[float, float, float]) -> None:
        self.numbers = Rotation.RPY(*state).numbers

    def __repr__(self) -> str:
        return "[" + ";\n ".join(text(self.numbers[at : at + 3]) for at in (0, 3, 6)) + "]"

    def __getitem__(self, position: tuple[int, int]) -> float:
        return self.numbers[self.place(position, 3, 3)]

    def __setitem__(self, position: tuple[int, int], value: float) -> None:
        self.numbers[self.place(position, 3, 3)] = number(value)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Vector):
            x, y, z = other.numbers
            m = self.numbers
            return Vector(*(m[at] * x + m[at + 1] * y + m[at + 2] * z for at in (0, 3, 6)))
        if isinstance(other, Rotation):
            return Rotation(self * other.UnitX(), self * other.UnitY(), self * other.UnitZ())
        if isinstance(other, Twist):
            return Twist(self * other.vel, self * other.rot)
        if isinstance(other, Wrench):
            return Wrench(self * other.force, self * other.torque)
        return NotImplemented

    def SetInverse(self) -> None:
        """Invert the rotation in place."""
        self.numbers[:] = itemgetter(0, 3, 6, 1, 4, 7, 2, 5, 8)(self.numbers)

    def Inverse(self, moved: Any = None) -> Any:
        """Return the inverse rotation, or a vector, twist or wrench that it has turned."""
        inverse = Rotation(self)
        inverse.SetInverse()
        return inverse if moved is None else inverse * checked(moved, Linear)

    @staticmethod
    def Identity() -> Rotation:
        """Return the rotation that turns nothing."""
        return Rotation()

    @staticmethod
    def RotX(angle: float) -> Rotation:
        """Return a rotation about the x axis."""
        s, c = sin_cos(angle)
        return Rotation(1, 0, 0, 0, c, -s, 0, s, c)

    @staticmethod
    def RotY(angle: float) -> Rotation:
        """Return a rotation about the y axis."""
        s, c = sin_cos(angle)
        return Rotation(c, 0, s, 0, 1, 0, -s, 0, c)

    @staticmethod
    def RotZ(angle: float) -> Rotation:
        """Return a rotation about the z axis."""
        s, c = sin_cos(angle)
        return Rotation(c, -s, 0, s, c, 0, 0, 0, 1)

    @staticmethod
    def Rot(rotvec: Vector, angle: float) -> Rotation:
        """Return a rotation about an axis."""
        axis = Vector(checked(rotvec, Vector))
        axis.Normalize()
        return Rotation.Rot2(axis, angle)

    @staticmethod
    def Rot2(rotvec: Vector, angle: float) -> Rotation:
        """Return a rotation about an axis of length 1."""
        x, y, z = checked(rotvec, Vector).numbers
        s, c = sin_cos(angle)
        t = 1 - c
        return Rotation(
            *(c + t * x * x, -z * s + t * x * y, y * s + t * x * z),
            *(z * s + t * x * y, c + t * y * y, -x * s + t * y * z),
            *(-y * s + t * x * z, x * s + t * y * z, c + t * z * z),
        )

    @staticmethod
    def EulerZYZ(alpha: float, beta: float, gamma: float) -> Rotation:
        """Return rotations about z, the new y and the new z."""
        (sa, ca), (sb, cb), (sg, cg) = map(sin_cos, (alpha, beta, gamma))
        return Rotation(
            *(ca * cb * cg - sa * sg, -ca * cb * sg - sa * cg, ca * sb),
            *(sa * cb * cg + ca * sg, -sa * cb * sg + ca * cg, sa * sb),
            *(-sb * cg, sb * sg, cb),
        )

    @staticmethod
    def EulerZYX(alpha: float, beta: float, gamma: float) -> Rotation:
        """Return rotations about z, the new y and the new x."""
        return Rotation.RPY(gamma, beta, alpha)

    @staticmethod
    def RPY(roll: float, pitch: float, yaw: float) -> Rotation:
        """Return rotations about the fixed x, y and z axes, in that order."""
        (sr, cr), (sp, cp), (sy, cy) = map(sin_cos, (roll, pitch, yaw))
        return Rotation(
            *(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            *(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            *(-sp, cp * sr, cp * cr),
        )

    @staticmethod
    def Quaternion(x: float, y: float, z: float, w: float) -> Rotation:
        """Return the rotation of a quaternion, which must have the length 1."""
        xx, yy, zz, ww = x * x, y * y, z * z, w * w
        return Rotation(
            *(ww + xx - yy - zz, 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y),
            *(2 * x * y + 2 * w * z, ww - xx + yy - zz, 2 * y * z - 2 * w * x),
            *(2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, ww - xx - yy + zz),
        )

    def DoRotX(self, angle: float) -> None:
        """Turn further about the x axis of the rotated frame."""
        self.numbers[:] = (self * Rotation.RotX(angle)).numbers

    def DoRotY(self, angle: float) -> None:
        """Turn further about the y axis of the rotated frame."""
        self.numbers[:] = (self * Rotation.RotY(angle)).numbers

    def DoRotZ(self, angle: float) -> None:
        """Turn further about the z axis of the rotated frame."""
        self.numbers[:] = (self * Rotation.RotZ(angle)).numbers

    def GetRPY(self) -> tuple[float, float, float]:
        """Return roll, pitch and yaw, as `RPY` takes them."""
        m = self.numbers
        pitch = math.atan2(-m[6], math.sqrt(m[0] * m[0] + m[3] * m[3]))
        if abs(pitch) > math.pi / 2 - NEARLY_ZERO:
            return 0.0, pitch, math.atan2(-m[1], m[4])
        return math.atan2(m[7], m[8]), pitch, math.atan2(m[3], m[0])

    def GetEulerZYX(self) -> tuple[float, float, float]:
        """Return the angles about z, y and x, as `EulerZYX` takes them."""
        roll, pitch, yaw = self.GetRPY()
        return yaw, pitch, roll

    def GetEulerZYZ(self) -> tuple[float, float, float]:
        """Return the angles about z, y and z, as `EulerZYZ` takes them."""
        m = self.numbers
        if abs(m[8]) <= 1 - NEARLY_ZERO:
            beta = math.atan2(math.sqrt(m[6] * m[6] + m[7] * m[7]), m[8])
            return math.atan2(m[5], m[2]), beta, math.atan2(m[7], -m[6])
        if m[8] > 0:
            return math.atan2(m[3], m[0]), 0.0, 0.0
        return math.atan2(-m[3], -m[0]), math.pi, 0.0

    def GetQuaternion(self) -> tuple[float, float, float, float]:
        """Return x, y, z and w of a quaternion."""
        m = self.numbers
        trace = m[0] + m[4] + m[8]
        turned = (m[7] - m[5], m[2] - m[6], m[3] - m[1])
        if trace > NEARLY_ZERO:
            scale = 0.5 / math.sqrt(trace + 1)
            x, y, z = (one * scale for one in turned)
            return x, y, z, 0.25 / scale
        # The largest of x, y and z comes first, as the others are divided by it.
        if m[0] > m[4] and m[0] > m[8]:
            i, j, k = 0, 1, 2
        else:
            i, j, k = (1, 0, 2) if m[4] > m[8] else (2, 0, 1)
        double = 2 * root(1 + m[4 * i] - m[4 * j] - m[4 * k])
        found = [0.0, 0.0, 0.0]
        found[i] = double / 4
        for other in (j, k):
            found[other] = over(m[3 * i + other] + m[3 * other + i], double)
        return found[0], found[1], found[2], over(turned[i], double)

    def GetRot(self) -> Vector:
        """Return the axis, with the angle as its length."""
        angle, axis = self.GetRotAngle()
        return axis * angle

    def GetRotAngle(self, eps: float = EPSILON) -> tuple[float, Vector]:
        """Return the angle, from 0 to pi, and the axis, which is z if the angle is 0."""
        m = self.numbers
        pairs = (m[1], m[3]), (m[2], m[6]), (m[5], m[7])
        trace = m[0] + m[4] + m[8]
        if not all(abs(a - b) < eps for a, b in pairs):
            axis = Vector(m[7] - m[5], m[2] - m[6], m[3] - m[1])
            angle = math.atan2(axis.Norm() / 2, (trace - 1) / 2)
            axis.Normalize()
            return angle, axis
        if all(abs(a + b) < eps * 10 for a, b in pairs) and abs(trace - 3) < eps * 10:
            return 0.0, Vector(0, 0, 1)
        # The matrix of half a turn is 2 a aT - 1: its largest column gives the axis a.
        squares = [(m[at] + 1) / 2 for at in (0, 4, 8)]
        if squares[0] > squares[1] and squares[0] > squares[2]:
            i = 0
        else:
            i = 1 if squares[1] > squares[2] else 2
        largest = root(squares[i])
        mixed = [over((m[3 * i + j] + m[3 * j + i]) / 4, largest) for j in range(3)]
        mixed[i] = largest
        return math.pi, Vector(*mixed)

    def UnitX(self, vec: Vector | None = None) -> Any:
        """Return the first column, or set it."""
        return self._column(0, vec)

    def UnitY(self, vec: Vector | None = None) -> Any:
        """Return the second column, or set it."""
        return self._column(1, vec)

    def UnitZ(self, vec: Vector | None = None) -> Any:
        """Return the third column, or set it."""
        return self._column(2, vec)

    def _column(self, position: int, vec: Vector | None) -> Vector | None:
        if vec is None:
            return Vector(*self.numbers[position::3])
        self.numbers[position::3] = checked(vec, Vector).numbers
        return None
