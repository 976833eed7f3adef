"""PyKDL: vectors, twists and wrenches."""

# ruff: noqa: N802  # KDL's names

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Self

from rosz.ros1.PyKDL.values import EPSILON, Linear, checked, number, over

__all__ = ("Twist", "Vector", "Wrench")


class Vector(Linear):
    """Three numbers; ``a * b`` of two vectors is their cross product.

    Args:
        x: First number, or a vector to copy.
        y: Second number.
        z: Third number.
    """

    kind = "Vector"

    def __init__(self, x: Any = None, y: Any = None, z: Any = None) -> None:
        given = [one for one in (x, y, z) if one is not None]
        if len(given) == 1 and isinstance(x, Vector):
            self.numbers = list(x.numbers)
        elif len(given) in (0, 3):
            self.numbers = [number(one) for one in given] or [0.0, 0.0, 0.0]
        else:
            raise TypeError(f"expected no argument, a Vector or three numbers, got {(x, y, z)}")

    def assign(self, numbers: Sequence[float]) -> None:  # noqa: D102
        self.numbers[:] = numbers

    def copied(self) -> Self:  # noqa: D102
        return Vector(self)  # type: ignore[return-value]  # also of a derived class, as KDL

    def __getstate__(self) -> tuple[float, ...]:
        return tuple(self.numbers)

    def __setstate__(self, state: tuple[float, float, float]) -> None:
        self.numbers = list(map(number, state))

    def __mul__(self, other: Any) -> Vector:
        if not isinstance(other, Vector):
            return super().__mul__(other)
        (a, b, c), (x, y, z) = self.numbers, other.numbers
        return Vector(b * z - c * y, c * x - a * z, a * y - b * x)

    def x(self, value: Any = None) -> float | None:
        """Return the first number, or set it."""
        return self._coordinate(0, value)

    def y(self, value: Any = None) -> float | None:
        """Return the second number, or set it."""
        return self._coordinate(1, value)

    def z(self, value: Any = None) -> float | None:
        """Return the third number, or set it."""
        return self._coordinate(2, value)

    def _coordinate(self, position: int, value: Any) -> float | None:
        if value is None:
            return self.numbers[position]
        self.numbers[position] = number(value)
        return None

    def Norm(self, eps: float = EPSILON) -> float:
        """Return the length; 0 if the largest number is the first one and below ``eps``."""
        x, y, z = map(abs, self.numbers)
        if x >= y and x >= z:
            if x < eps:
                return 0.0
            largest, others = x, (y, z)
        else:
            largest, others = (y, (x, z)) if y > z else (z, (x, y))
        a, b = (over(one, largest) for one in others)
        return largest * math.sqrt(1 + a * a + b * b)

    def Normalize(self, eps: float = EPSILON) -> float:
        """Give the vector the length 1, and return what it was.

        A vector that is shorter than ``eps`` becomes (1, 0, 0), and the result is 0.
        """
        length = self.Norm()
        if length < eps:
            self.numbers[:] = 1.0, 0.0, 0.0
            return 0.0
        self.numbers[:] = [one / length for one in self.numbers]
        return length

    @staticmethod
    def Zero() -> Vector:
        """Return a vector of zeros."""
        return Vector()


class _Pair(Linear):
    """Two vectors, to be read and set under the names of the class that is derived."""

    def __init__(self, first: Any, second: Any) -> None:
        if isinstance(first, _Pair) and first.kind == self.kind and second is None:
            first, second = first.pair
        elif first is None and second is None:
            first, second = Vector(), Vector()
        self.pair: tuple[Vector, Vector] = (
            Vector(checked(first, Vector)),
            Vector(checked(second, Vector)),
        )

    @property
    def numbers(self) -> list[float]:  # type: ignore[override]  # made of both
        return self.pair[0].numbers + self.pair[1].numbers

    def assign(self, numbers: Sequence[float]) -> None:
        self.pair[0].assign(numbers[:3])
        self.pair[1].assign(numbers[3:])

    def __getstate__(self) -> tuple[Vector, Vector]:
        return self.pair

    def __setstate__(self, state: tuple[Vector, Vector]) -> None:
        self.pair = state


class Twist(_Pair):
    """A velocity and a rate of turning.

    Args:
        vel: Velocity in metres per second, or a twist to copy.
        rot: Rate of turning in radians per second.
    """

    kind = "Twist"

    def __init__(self, vel: Any = None, rot: Any = None) -> None:
        super().__init__(vel, rot)

    def copied(self) -> Self:  # noqa: D102
        return Twist(*self.pair)  # type: ignore[return-value]  # also of a derived class, as KDL

    @property
    def vel(self) -> Vector:
        """The velocity in metres per second."""
        return self.pair[0]

    @vel.setter
    def vel(self, value: Vector) -> None:
        self.pair[0].assign(checked(value, Vector).numbers)

    @property
    def rot(self) -> Vector:
        """The rate of turning in radians per second."""
        return self.pair[1]

    @rot.setter
    def rot(self, value: Vector) -> None:
        self.pair[1].assign(checked(value, Vector).numbers)

    def RefPoint(self, base: Vector) -> Twist:
        """Return the twist at another point, which lies at ``base`` from this one's."""
        return Twist(self.vel + self.rot * checked(base, Vector), self.rot)

    @staticmethod
    def Zero() -> Twist:
        """Return a twist of zeros."""
        return Twist()


class Wrench(_Pair):
    """A force and a torque.

    Args:
        force: Force in newtons, or a wrench to copy.
        torque: Torque in newton metres.
    """

    kind = "Wrench"

    def __init__(self, force: Any = None, torque: Any = None) -> None:
        super().__init__(force, torque)

    def copied(self) -> Self:  # noqa: D102
        return Wrench(*self.pair)  # type: ignore[return-value]  # also of a derived class, as KDL

    @property
    def force(self) -> Vector:
        """The force in newtons."""
        return self.pair[0]

    @force.setter
    def force(self, value: Vector) -> None:
        self.pair[0].assign(checked(value, Vector).numbers)

    @property
    def torque(self) -> Vector:
        """The torque in newton metres."""
        return self.pair[1]

    @torque.setter
    def torque(self, value: Vector) -> None:
        self.pair[1].assign(checked(value, Vector).numbers)

    def RefPoint(self, base: Vector) -> Wrench:
        """Return the wrench at another point, which lies at ``base`` from this one's."""
        return Wrench(self.force, self.torque + self.force * checked(base, Vector))

    @staticmethod
    def Zero() -> Wrench:
        """Return a wrench of zeros."""
        return Wrench()
