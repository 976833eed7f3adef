"""The base of PyKDL's types: comparison, copies and arithmetic by their numbers."""

# ruff: noqa: N802  # KDL's names

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from operator import index
from typing import Any, ClassVar, Self, TypeVar

__all__ = (
    "EPSILON",
    "NEARLY_ZERO",
    "Linear",
    "Value",
    "checked",
    "is_number",
    "near",
    "number",
    "over",
    "root",
    "sin_cos",
    "text",
)

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
    return ",".join(f"{one:12.6g}" for one in numbers)


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
        raise NotImplementedError

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
        indices = [index(one) for one in (position if len(sizes) > 1 else [position])]
        if len(indices) != len(sizes):
            raise TypeError(f"expected {len(sizes)} indices, got {position!r}")
        if not all(0 <= one < size for one, size in zip(indices, sizes, strict=True)):
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
        return self._made(-one for one in self.numbers)

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
        return self._made(one * factor for one in self.numbers)

    def __rmul__(self, other: Any) -> Self:
        return Linear.__mul__(self, other)

    def __truediv__(self, other: Any) -> Self:
        if not is_number(other):
            return NotImplemented
        divisor = number(other)
        return self._made(over(one, divisor) for one in self.numbers)

    def ReverseSign(self) -> None:
        """Change the sign of each number."""
        self.assign([-one for one in self.numbers])
