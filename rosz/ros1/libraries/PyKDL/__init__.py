"""PyKDL: vectors, rotations, frames, twists and wrenches (Orocos KDL).

Angles are radians. Chains, trees, solvers, inertias and the types with velocities are missing,
since they need KDL's C++. Unlike those of PyKDL 1.5, objects take attributes of their own, such as
the ``header`` that `tf2_ros.Stamped` gives them.
"""

# ruff: noqa: N802, N803  # KDL's names

from __future__ import annotations

import math
from operator import itemgetter
from typing import Any

from rosz.ros1.libraries.PyKDL.linear import (
    EPSILON,
    NEARLY_ZERO,
    Linear,
    Twist,
    Value,
    Vector,
    Wrench,
    checked,
    near,
    number,
    over,
    root,
    sin_cos,
    text,
)

__all__ = (
    "Equal",
    "Frame",
    "Rotation",
    "SetToZero",
    "Twist",
    "Vector",
    "Wrench",
    "addDelta",
    "diff",
    "dot",
)

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
            columns = [checked(value, Vector).numbers for value in given]
            self.numbers = [column[row] for row in range(3) for column in columns]
        elif len(given) == 9:  # noqa: PLR2004  # the whole matrix
            self.numbers = [number(value) for value in given]
        else:
            raise TypeError(f"expected a Rotation, three Vectors or nine numbers, got {given}")

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
            x, y, z = (part * scale for part in turned)
            return x, y, z, 0.25 / scale
        # The largest of x, y and z comes first, as the others are divided by it.
        if m[0] > m[4] and m[0] > m[8]:
            i, j, k = 0, 1, 2
        else:
            i, j, k = (1, 0, 2) if m[4] > m[8] else (2, 0, 1)
        double = 2 * root(1 + m[4 * i] - m[4 * j] - m[4 * k])
        vector = [0.0, 0.0, 0.0]
        vector[i] = double / 4
        for other in (j, k):
            vector[other] = over(m[3 * i + other] + m[3 * other + i], double)
        return vector[0], vector[1], vector[2], over(turned[i], double)

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


_LEAST_ANGLE = 1e-10


class Frame(Value):
    """A rotation ``M`` and an origin ``p``.

    Args:
        R: The rotation, or a frame to copy, or the origin.
        V: The origin.
    """

    kind = "Frame"

    def __init__(self, R: Any = None, V: Any = None) -> None:
        turned, origin = R, V
        if isinstance(R, Frame) and V is None:
            turned, origin = R.M, R.p
        elif isinstance(R, Vector) and V is None:
            turned, origin = None, R
        self._rotation = Rotation() if turned is None else Rotation(checked(turned, Rotation))
        self._origin = Vector() if origin is None else Vector(checked(origin, Vector))

    @property
    def M(self) -> Rotation:
        """The rotation."""
        return self._rotation

    @M.setter
    def M(self, value: Rotation) -> None:
        self._rotation.numbers[:] = checked(value, Rotation).numbers

    @property
    def p(self) -> Vector:
        """The origin."""
        return self._origin

    @p.setter
    def p(self, value: Vector) -> None:
        self._origin.numbers[:] = checked(value, Vector).numbers

    @property
    def numbers(self) -> list[float]:  # type: ignore[override]  # noqa: D102
        return self.M.numbers + self.p.numbers

    def __getstate__(self) -> tuple[Rotation, Vector]:
        return self.M, self.p

    def __setstate__(self, state: tuple[Rotation, Vector]) -> None:
        self._rotation, self._origin = state

    def __repr__(self) -> str:
        return f"[{self.M!r}\n{self.p!r}]"

    def __getitem__(self, position: tuple[int, int]) -> float:
        row, column = divmod(self.place(position, 3, 4), 4)
        return self.p[row] if column == 3 else self.M[row, column]  # noqa: PLR2004  # the last one

    def __setitem__(self, position: tuple[int, int], value: float) -> None:
        row, column = divmod(self.place(position, 3, 4), 4)
        if column == 3:  # noqa: PLR2004  # the last one
            self.p[row] = value
        else:
            self.M[row, column] = value

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Vector):
            return self.M * other + self.p
        if isinstance(other, Frame):
            return Frame(self.M * other.M, self * other.p)
        if isinstance(other, Twist):
            rot = self.M * other.rot
            return Twist(self.M * other.vel + self.p * rot, rot)
        if isinstance(other, Wrench):
            force = self.M * other.force
            return Wrench(force, self.M * other.torque + self.p * force)
        return NotImplemented

    def Inverse(self, moved: Any = None) -> Any:
        """Return the inverse frame, or a vector, twist or wrench that it has moved."""
        back = self.M.Inverse()
        if moved is None:
            return Frame(back, -(back * self.p))
        if isinstance(moved, Twist):
            return Twist(back * (moved.vel - self.p * moved.rot), back * moved.rot)
        if isinstance(moved, Wrench):
            return Wrench(back * moved.force, back * (moved.torque - self.p * moved.force))
        return back * (checked(moved, Vector) - self.p)

    def Integrate(self, twist: Twist, sample_frequency: float) -> None:
        """Move the frame by a twist in its own axes, for one period.

        Args:
            twist: The twist.
            sample_frequency: Periods in a second.
        """
        step = checked(twist, Twist).vel / sample_frequency
        angle = over(twist.rot.Norm(), number(sample_frequency))
        if angle < EPSILON:
            self.p += self.M * step
            return
        moved = self * Frame(Rotation.Rot(twist.rot, angle), step)
        self.M, self.p = moved.M, moved.p

    @staticmethod
    def Identity() -> Frame:
        """Return the frame that moves nothing."""
        return Frame()

    @staticmethod
    def DH(a: float, alpha: float, d: float, theta: float) -> Frame:
        """Return the frame of a joint from its Denavit-Hartenberg parameters.

        Args:
            a: Length of the link in metres.
            alpha: Twist of the link in radians.
            d: Offset of the link in metres.
            theta: Angle of the joint in radians.
        """
        (st, ct), (sa, ca) = sin_cos(theta), sin_cos(alpha)
        turned = Rotation(ct, -st * ca, st * sa, st, ct * ca, -ct * sa, 0, sa, ca)
        return Frame(turned, Vector(a * ct, a * st, d))

    @staticmethod
    def DH_Craig1989(a: float, alpha: float, d: float, theta: float) -> Frame:
        """Return the frame of a joint from Craig's Denavit-Hartenberg parameters.

        Args:
            a: Length of the link before in metres.
            alpha: Twist of the link before in radians.
            d: Offset of the link in metres.
            theta: Angle of the joint in radians.
        """
        (st, ct), (sa, ca) = sin_cos(theta), sin_cos(alpha)
        turned = Rotation(ct, -st, 0, st * ca, ct * ca, -sa, st * sa, ct * sa, ca)
        return Frame(turned, Vector(a, -sa * d, ca * d))


def dot(a: Any, b: Any) -> float:
    """Return the dot product of two vectors, or of a twist and a wrench."""
    if isinstance(a, Vector) and isinstance(b, Vector):
        return sum(x * y for x, y in zip(a.numbers, b.numbers, strict=True))
    if isinstance(a, Wrench) and isinstance(b, Twist):
        a, b = b, a
    if isinstance(a, Twist) and isinstance(b, Wrench):
        return dot(a.vel, b.force) + dot(a.rot, b.torque)
    raise TypeError(f"expected two Vectors, or a Twist and a Wrench, got {a!r} and {b!r}")


def diff(a: Any, b: Any, dt: float = 1) -> Any:
    """Return the velocity that takes one value to another.

    Args:
        a: A vector, rotation, frame, twist or wrench.
        b: Another one.
        dt: Time in seconds.
    """
    if isinstance(a, Rotation):
        return a * (a.Inverse() * checked(b, Rotation)).GetRot() / dt
    if isinstance(a, Frame):
        return Twist(diff(a.p, checked(b, Frame).p, dt), diff(a.M, b.M, dt))
    return (checked(b, Linear) - checked(a, Linear)) / dt


def addDelta(a: Any, da: Any, dt: float = 1) -> Any:
    """Return a value after some time at a velocity.

    Args:
        a: A vector, rotation, frame, twist or wrench.
        da: Its velocity: a vector for a rotation, a twist for a frame.
        dt: Time in seconds.
    """
    if isinstance(a, Rotation):
        axis = checked(da, Vector) * dt
        angle = axis.Normalize(_LEAST_ANGLE)
        return Rotation.Rot2(axis, angle) * a
    if isinstance(a, Frame):
        return Frame(addDelta(a.M, checked(da, Twist).rot, dt), addDelta(a.p, da.vel, dt))
    return checked(a, Linear) + checked(da, Linear) * dt


def Equal(a: Any, b: Any, eps: float = EPSILON) -> bool:
    """Tell whether the numbers of two values differ by less than ``eps``."""
    if checked(a, Value).kind != checked(b, Value).kind:
        raise TypeError(f"expected two values of one type, got {a!r} and {b!r}")
    return near(a.numbers, b.numbers, eps)


def SetToZero(value: Any) -> None:
    """Set the numbers of a vector, twist or wrench to zero."""
    checked(value, Linear).assign([0.0] * len(value.numbers))


_IN_CPP = (
    "Add Chain ChainDynParam ChainFkSolverPos ChainFkSolverPos_recursive ChainFkSolverVel"
    " ChainFkSolverVel_recursive ChainIdSolver ChainIdSolver_RNE ChainIkSolverPos"
    " ChainIkSolverPos_LMA ChainIkSolverPos_NR ChainIkSolverPos_NR_JL ChainIkSolverVel"
    " ChainIkSolverVel_pinv ChainIkSolverVel_pinv_givens ChainIkSolverVel_pinv_nso"
    " ChainIkSolverVel_wdls ChainJntToJacDotSolver ChainJntToJacSolver Divide FrameVel Jacobian"
    " JntArray JntArrayVel JntSpaceInertiaMatrix Joint Multiply MultiplyJacobian RigidBodyInertia"
    " RotationVel RotationalInertia Segment SolverI Subtract Tree TwistVel VectorVel changeBase"
    " changeRefPoint doubleVel"
)


def __getattr__(name: str) -> Any:
    text = f"module 'PyKDL' of rosz has no attribute '{name}'"
    if name in _IN_CPP.split():
        text += (
            ": it needs KDL's C++, and rosz has the geometry alone; run this program with a Python"
            " that has the real PyKDL (Debian: python3-pykdl)"
        )
    raise AttributeError(text, name=name)
