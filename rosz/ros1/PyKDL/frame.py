"""PyKDL: frames, and the functions of all types."""

# ruff: noqa: N802, N803  # KDL's names

from __future__ import annotations

from typing import Any, Self

from rosz.ros1.PyKDL.linear import Twist, Vector, Wrench
from rosz.ros1.PyKDL.rotation import Rotation
from rosz.ros1.PyKDL.values import EPSILON, Linear, Value, checked, near, number, over, sin_cos

__all__ = ("Equal", "Frame", "SetToZero", "addDelta", "diff", "dot")


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

    def copied(self) -> Self:  # noqa: D102
        return Frame(self)  # type: ignore[return-value]  # also of a derived class, as KDL

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
