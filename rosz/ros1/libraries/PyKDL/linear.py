"""PyKDL: vectors, twists and wrenches, and the base of all types.

The base has comparison, copies and arithmetic by the numbers of a value.
"""

# ruff: noqa: N802  # KDL's names

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from operator import index
from typing import Any, ClassVar, Self, TypeVar

EPSILON = 1e-6
NEARLY_ZERO = 1e-12

AnyValue = TypeVar("AnyValue", bound="Value")


def number(value: Any) -> float:
    """Return a value as a float, but not a text."""
    if isinstance(value, str | bytes):
        raise TypeError(f"expected a number, got {value!r}")
    return float(value)


def is_number(value: Any) -> bool:
    """Tell whether a value converts to a float."""
    return hasattr(value, "__float__") or hasattr(value, "__index__")


def over(a: float, b: float) -> float:
    """Divide as C++ does, without an error."""
    if b:
        return a / b
    return math.nan if not a or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1, b)


def root(value: float) -> float:
    """Return the square root as C++ does, without an error."""
    return math.nan if value < 0 else math.sqrt(value)


def sin_cos(angle: float) -> tuple[float, float]:
    """Return the sine and the cosine as C++ does, without an error."""
    return (math.nan, math.nan) if math.isinf(angle) else (math.sin(angle), math.cos(angle))


def text(numbers: Iterable[float]) -> str:
    """Return numbers as KDL prints them."""
    return ",".join(f"{value:12.6g}" for value in numbers)


def near(a: Iterable[float], b: Iterable[float], eps: float) -> bool:
    """Tell whether the numbers of two values differ by less than ``eps``."""
    return all(-eps < x - y < eps for x, y in zip(a, b, strict=True))


def checked(value: Any, kind: type[AnyValue]) -> AnyValue:
    """Return a value of a type.

    Raises:
        TypeError: The value has another type.
    """
    if not isinstance(value, kind):
        raise TypeError(f"expected a {kind.kind} of PyKDL, got {value!r}")
    return value


class Value:
    """The base of all types: comparison and copies by their numbers."""

    __hash__ = None  # type: ignore[assignment]  # they are mutable

    kind: ClassVar[str] = "value"
    """Name of the type, also in classes that programs derive."""

    numbers: list[float]
    """All numbers, row by row."""

    def copied(self) -> Self:
        """Return a copy, without attributes of its own."""
        # Of an object of a derived class, too, it has the class of PyKDL, as in KDL.
        plain: Any = next(each for each in type(self).__mro__ if "kind" in vars(each))
        copy: Self = plain(self)
        return copy

    def __setattr__(self, name: str, value: Any) -> None:
        if callable(getattr(type(self), name, None)):  # as `vector.x = 1`, which is vector.x(1)
            raise AttributeError(f"'PyKDL.{self.kind}' object attribute '{name}' is read-only")  # noqa: TRY004
        super().__setattr__(name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Value) or other.kind != self.kind:
            return NotImplemented
        return near(self.numbers, other.numbers, EPSILON)

    def __copy__(self) -> Self:
        return self.copied()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self.copied()

    def place(self, position: Any, *sizes: int) -> int:
        """Return the place of an index, or of a pair of them, among the numbers."""
        indices = [index(at) for at in (position if len(sizes) > 1 else [position])]
        if len(indices) != len(sizes):
            raise TypeError(f"expected {len(sizes)} indices, got {position!r}")
        if not all(0 <= at < size for at, size in zip(indices, sizes, strict=True)):
            raise IndexError(f"{self.kind} index out of range")
        return indices[0] if len(sizes) == 1 else indices[0] * sizes[1] + indices[1]


class Linear(Value):
    """The base of types that can be added and scaled: vectors, twists and wrenches."""

    kind = "Vector, Twist or Wrench"

    def assign(self, numbers: Sequence[float]) -> None:
        """Set all numbers."""
        raise NotImplementedError

    def _made(self, numbers: Iterable[float]) -> Self:
        made = self.copied()
        made.assign(list(numbers))
        return made

    def _is_like(self, other: Any) -> bool:
        return isinstance(other, Linear) and other.kind == self.kind

    def __repr__(self) -> str:
        return f"[{text(self.numbers)}]"

    def __getitem__(self, position: int) -> float:
        numbers = self.numbers
        return numbers[self.place(position, len(numbers))]

    def __setitem__(self, position: int, value: float) -> None:
        numbers = self.numbers
        numbers[self.place(position, len(numbers))] = number(value)
        self.assign(numbers)

    def __neg__(self) -> Self:
        return self._made(-value for value in self.numbers)

    def __add__(self, other: Any) -> Self:
        if not self._is_like(other):
            return NotImplemented
        return self._made(a + b for a, b in zip(self.numbers, other.numbers, strict=True))

    def __sub__(self, other: Any) -> Self:
        if not self._is_like(other):
            return NotImplemented
        return self._made(a - b for a, b in zip(self.numbers, other.numbers, strict=True))

    def __iadd__(self, other: Any) -> Self:
        if not self._is_like(other):
            return NotImplemented
        self.assign((self + other).numbers)
        return self

    def __isub__(self, other: Any) -> Self:
        if not self._is_like(other):
            return NotImplemented
        self.assign((self - other).numbers)
        return self

    def __mul__(self, other: Any) -> Self:
        if not is_number(other):
            return NotImplemented
        factor = number(other)
        return self._made(value * factor for value in self.numbers)

    def __rmul__(self, other: Any) -> Self:
        return Linear.__mul__(self, other)

    def __truediv__(self, other: Any) -> Self:
        if not is_number(other):
            return NotImplemented
        divisor = number(other)
        return self._made(over(value, divisor) for value in self.numbers)

    def ReverseSign(self) -> None:
        """Change the sign of each number."""
        self.assign([-value for value in self.numbers])


class Vector(Linear):
    """Three numbers; ``a * b`` of two vectors is their cross product.

    Args:
        x: First number, or a vector to copy.
        y: Second number.
        z: Third number.
    """

    kind = "Vector"

    def __init__(self, x: Any = None, y: Any = None, z: Any = None) -> None:
        given = [value for value in (x, y, z) if value is not None]
        if len(given) == 1 and isinstance(x, Vector):
            self.numbers = list(x.numbers)
        elif len(given) in (0, 3):
            self.numbers = [number(value) for value in given] or [0.0, 0.0, 0.0]
        else:
            raise TypeError(f"expected no argument, a Vector or three numbers, got {(x, y, z)}")

    def assign(self, numbers: Sequence[float]) -> None:  # noqa: D102
        self.numbers[:] = numbers

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
        a, b = (over(other, largest) for other in others)
        return largest * math.sqrt(1 + a * a + b * b)

    def Normalize(self, eps: float = EPSILON) -> float:
        """Give the vector the length 1, and return its former length.

        A vector that is shorter than ``eps`` becomes (1, 0, 0), and the result is 0.
        """
        length = self.Norm()
        if length < eps:
            self.numbers[:] = 1.0, 0.0, 0.0
            return 0.0
        self.numbers[:] = [coordinate / length for coordinate in self.numbers]
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


def _part(at: int, doc: str) -> Any:
    """Return the property for a vector of a pair."""

    def get(self: _Pair) -> Vector:
        return self.pair[at]

    def put(self: _Pair, value: Vector) -> None:
        self.pair[at].assign(checked(value, Vector).numbers)

    return property(get, put, doc=doc)


class Twist(_Pair):
    """A velocity and a rate of turning.

    Args:
        vel: Velocity in metres per second, or a twist to copy.
        rot: Rate of turning in radians per second.
    """

    kind = "Twist"

    def __init__(self, vel: Any = None, rot: Any = None) -> None:
        super().__init__(vel, rot)

    vel: Vector = _part(0, "The velocity in metres per second.")
    rot: Vector = _part(1, "The rate of turning in radians per second.")

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

    force: Vector = _part(0, "The force in newtons.")
    torque: Vector = _part(1, "The torque in newton metres.")

    def RefPoint(self, base: Vector) -> Wrench:
        """Return the wrench at another point, which lies at ``base`` from this one's."""
        return Wrench(self.force, self.torque + self.force * checked(base, Vector))

    @staticmethod
    def Zero() -> Wrench:
        """Return a wrench of zeros."""
        return Wrench()
