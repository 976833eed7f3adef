"""ROS 1's arithmetic for times and durations (genpy, ``rospy.Time`` and ``rospy.Duration``).

The classes have no fields of their own: they are bases of the generated messages
builtin_interfaces/Time and Duration, whose fields ``sec`` and ``nanosec`` they also provide as
``secs`` and ``nsecs``. Results are in normal form: nanoseconds from 0 to 999 999 999, the sign in
the seconds.
"""

from __future__ import annotations

import numbers
from typing import TYPE_CHECKING, Any, ClassVar, Self, overload

import msgspec

__all__ = ("ClassicConstructor", "DurationValue", "StampValue", "TimeValue", "normal")

_NS = 1_000_000_000


def normal(secs: int, nsecs: int) -> tuple[int, int]:
    """Return seconds and nanoseconds with the nanoseconds from 0 to 999 999 999."""
    return secs + nsecs // _NS, nsecs % _NS


def _split(seconds: float) -> tuple[int, int]:
    """Return seconds in normal form, rounded towards zero as in genpy."""
    whole = int(seconds)
    return normal(whole, int((seconds - whole) * _NS))


class ClassicConstructor(msgspec.StructMeta):
    """Metaclass of times with ROS 1's constructor.

    ``Time(1.5)``, ``Time(1, 500)`` and ``Time(secs=1)``; the result is in normal form.
    """

    def __call__(cls, secs: float = 0, nsecs: int = 0) -> Any:  # noqa: N805  # a metaclass
        """Make a time or duration.

        Raises:
            ValueError: Seconds are a float, and nanoseconds are given too.
            TypeError: The time is before the epoch.
        """
        if isinstance(secs, numbers.Integral):
            sec, nanosec = normal(int(secs), int(nsecs))
        elif nsecs:
            raise ValueError(
                f"seconds are a float ({secs}), so nanoseconds ({nsecs}) have no place"
            )
        else:
            sec, nanosec = _split(secs)
        if sec < 0 and issubclass(cls, TimeValue):
            raise TypeError(f"a time cannot be before the epoch, got {sec} s")
        return super().__call__(sec, nanosec)


class StampValue:
    """Base of times and durations."""

    if not TYPE_CHECKING:  # the fields are those of the message classes below
        __slots__ = ()
    _ros1_names: ClassVar[dict[str, str]] = {"secs": "sec", "nsecs": "nanosec"}
    _duration_class: ClassVar[Any] = None

    sec: int
    nanosec: int

    @property
    def secs(self) -> int:
        """Seconds, as ROS 1 spells them."""
        return self.sec

    @secs.setter
    def secs(self, value: int) -> None:
        self.sec = value

    @property
    def nsecs(self) -> int:
        """Nanoseconds beyond the seconds, as ROS 1 spells them."""
        return self.nanosec

    @nsecs.setter
    def nsecs(self, value: int) -> None:
        self.nanosec = value

    @classmethod
    def _of(cls, secs: int, nsecs: int) -> Self:
        sec, nanosec = normal(secs, nsecs)
        if sec < 0 and issubclass(cls, TimeValue):
            raise TypeError(f"a time cannot be before the epoch, got {sec} s")
        build: Any = cls
        value: Self = build(sec, nanosec)
        return value

    @classmethod
    def from_sec(cls, float_secs: float) -> Self:
        """Return a value from a number of seconds.

        Raises:
            TypeError: A time would be before the epoch.
        """
        return cls._of(*_split(float_secs))

    @classmethod
    def from_nsec(cls, nanoseconds: int) -> Self:
        """Return a value from a number of nanoseconds.

        Raises:
            TypeError: A time would be before the epoch.
        """
        return cls._of(0, nanoseconds)

    def to_sec(self) -> float:
        """Return seconds as a float."""
        return float(self.sec) + float(self.nanosec) / 1e9

    def to_nsec(self) -> int:
        """Return nanoseconds."""
        return self.sec * _NS + self.nanosec

    def is_zero(self) -> bool:
        """Return whether it is zero."""
        return self.sec == 0 and self.nanosec == 0

    def set(self, secs: int, nsecs: int) -> None:
        """Set seconds and nanoseconds without normalising them."""
        self.sec, self.nanosec = secs, nsecs

    def canon(self) -> None:
        """Normalise seconds and nanoseconds."""
        self.sec, self.nanosec = normal(self.sec, self.nanosec)

    def _comparable(self, other: object) -> int | None:
        """Return the nanoseconds of another value if it is of the same kind."""
        raise NotImplementedError(type(other).__name__)

    def __bool__(self) -> bool:
        return not self.is_zero()

    def __hash__(self) -> int:
        return hash((self.sec, self.nanosec))

    def __str__(self) -> str:
        return str(self.to_nsec())

    def __eq__(self, other: object) -> bool:
        if self._comparable(other) is None:
            return False
        return (self.sec, self.nanosec) == (getattr(other, "sec", 0), getattr(other, "nanosec", 0))

    def __lt__(self, other: object) -> bool:
        theirs = self._comparable(other)
        return NotImplemented if theirs is None else self.to_nsec() < theirs

    def __le__(self, other: object) -> bool:
        theirs = self._comparable(other)
        return NotImplemented if theirs is None else self.to_nsec() <= theirs

    def __gt__(self, other: object) -> bool:
        theirs = self._comparable(other)
        return NotImplemented if theirs is None else self.to_nsec() > theirs

    def __ge__(self, other: object) -> bool:
        theirs = self._comparable(other)
        return NotImplemented if theirs is None else self.to_nsec() >= theirs


class TimeValue(StampValue):
    """A point in time: seconds and nanoseconds since the epoch."""

    if not TYPE_CHECKING:
        __slots__ = ()

    def _comparable(self, other: object) -> int | None:
        return other.to_nsec() if isinstance(other, TimeValue) else None

    def to_time(self) -> float:
        """Return seconds as a float, as ``time.time`` does."""
        return self.to_sec()

    def __add__(self, other: object) -> Self:
        if not isinstance(other, DurationValue):
            return NotImplemented
        return self._of(self.sec + other.sec, self.nanosec + other.nanosec)

    __radd__ = __add__

    @overload
    def __sub__(self, other: TimeValue) -> DurationValue: ...
    @overload
    def __sub__(self, other: DurationValue) -> Self: ...
    def __sub__(self, other: object) -> DurationValue | Self:
        if isinstance(other, TimeValue):
            difference = normal(self.sec - other.sec, self.nanosec - other.nanosec)
            duration: DurationValue = self._duration_class(*difference)
            return duration
        if isinstance(other, DurationValue):
            return self._of(self.sec - other.sec, self.nanosec - other.nanosec)
        return NotImplemented


class DurationValue(StampValue):
    """A span of time, which may be negative."""

    if not TYPE_CHECKING:
        __slots__ = ()

    def __init_subclass__(cls, **options: object) -> None:
        super().__init_subclass__(**options)
        shared = StampValue
        if shared._duration_class is None:  # noqa: SLF001  # of this module
            # The first subclass is the message class, the type of a difference of times.
            shared._duration_class = cls  # noqa: SLF001

    def _comparable(self, other: object) -> int | None:
        return other.to_nsec() if isinstance(other, DurationValue) else None

    def __neg__(self) -> Self:
        return self._of(-self.sec, -self.nanosec)

    def __abs__(self) -> Self:
        return self if self.sec >= 0 else -self

    def __add__(self, other: object) -> Self:
        if not isinstance(other, DurationValue):
            return NotImplemented
        return self._of(self.sec + other.sec, self.nanosec + other.nanosec)

    __radd__ = __add__

    def __sub__(self, other: object) -> Self:
        if not isinstance(other, DurationValue):
            return NotImplemented
        return self._of(self.sec - other.sec, self.nanosec - other.nanosec)

    def __mul__(self, factor: object) -> Self:
        if isinstance(factor, numbers.Integral):
            return self._of(self.sec * int(factor), self.nanosec * int(factor))
        if isinstance(factor, numbers.Real):
            return self.from_sec(self.to_sec() * float(factor))
        return NotImplemented

    __rmul__ = __mul__

    @overload
    def __floordiv__(self, divisor: float) -> Self: ...
    @overload
    def __floordiv__(self, divisor: DurationValue) -> int: ...
    def __floordiv__(self, divisor: object) -> Self | int:
        if isinstance(divisor, numbers.Real):
            return self.from_sec(self.to_sec() // float(divisor))
        if isinstance(divisor, DurationValue):
            return int(self.to_sec() // divisor.to_sec())
        return NotImplemented

    @overload
    def __truediv__(self, divisor: float) -> Self: ...
    @overload
    def __truediv__(self, divisor: DurationValue) -> float: ...
    def __truediv__(self, divisor: object) -> Self | float:
        if isinstance(divisor, numbers.Real):
            return self.from_sec(self.to_sec() / float(divisor))
        if isinstance(divisor, DurationValue):
            return self.to_sec() / divisor.to_sec()
        return NotImplemented

    def __mod__(self, divisor: object) -> Self:
        if not isinstance(divisor, DurationValue):
            return NotImplemented
        return self.from_sec(self.to_sec() % divisor.to_sec())

    def __divmod__(self, divisor: object) -> tuple[int, Self]:
        if not isinstance(divisor, DurationValue):
            return NotImplemented
        quotient, remainder = divmod(self.to_sec(), divisor.to_sec())
        return int(quotient), self.from_sec(remainder)
