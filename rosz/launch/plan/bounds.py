"""What an expression may call, and how much it may take.

`$(eval …)` runs text that a stranger may have written, so nothing here can reach beyond values:
the functions are a closed list, methods go by type and name, and whatever could take long or grow
large is charged to a budget before it is done.
"""

from __future__ import annotations

import math
import re
import string
from collections.abc import Callable, Mapping, Sequence
from typing import Any

__all__ = ("Budget", "ExpressionError", "Method", "functions", "weight")

_MAX_BITS = 4096
_MAX_WIDTH = 9_999
_WIDE = re.compile(r"\d{5,}")
_WIDE_PERCENT = re.compile(r"%(\([^)]*\))?[^a-zA-Z%]*?\d{5,}")
_STAR_PERCENT = re.compile(r"%(\([^)]*\))?[^a-zA-Z%]*\*")
_MAX_DIGITS = 400
_PLAIN = (bool, int, float, complex, str, type(None))

_METHODS: Mapping[type, frozenset[str]] = {
    str: frozenset(
        name
        for name in dir(str)
        if not name.startswith("_")
        and name not in {"encode", "expandtabs", "format_map", "maketrans", "translate"}
    ),
    list: frozenset({"copy", "count", "index"}),
    tuple: frozenset({"count", "index"}),
    dict: frozenset({"copy", "get", "items", "keys", "values"}),
    range: frozenset({"count", "index"}),
    set: frozenset({"difference", "intersection", "issubset", "issuperset", "union"}),
    int: frozenset({"bit_length", "conjugate"}),
    float: frozenset({"hex", "is_integer"}),
}


class ExpressionError(Exception):
    """An expression that is not allowed, or takes too much."""


class Budget:
    """What an expression may still take: about one unit per step, element and 64 characters.

    Args:
        units: How many.
    """

    def __init__(self, units: int) -> None:
        self._units = units
        self._left = units

    def charge(self, units: int) -> None:
        """Take some.

        Raises:
            ExpressionError: There is not enough left.
        """
        self._left -= units
        if self._left < 0:
            raise ExpressionError(f"it takes more than {self._units} steps or elements")

    def settle(self, value: Any) -> Any:
        """Charge a value that came about, and return it."""
        self.charge(1 + weight(value, self._left + 1))
        return value

    def repeat(self, sequence: Sequence[Any], times: int) -> None:
        """Charge a repetition of a text or list before it is made."""
        unit = 64 if isinstance(sequence, str) else 1
        self.charge(len(sequence) * max(times, 0) // unit)

    def bits(self, count: float) -> None:
        """Refuse whole numbers of so many bits."""
        if count > _MAX_BITS:
            raise ExpressionError(f"it makes a number of more than {_MAX_BITS} bits")
        self.charge(int(count) // 256)


def weight(value: Any, limit: int) -> int:
    """Count the elements of a value, at any depth, up to a limit."""
    total = 0
    stack = [value]
    while stack and total <= limit:
        item = stack.pop()
        if isinstance(item, str):
            total += len(item) // 64
        elif isinstance(item, range):
            total += len(item)
        elif isinstance(item, dict):
            total += len(item)
            stack += item.keys()
            stack += item.values()
        elif isinstance(item, list | tuple | set | frozenset):
            total += len(item)
            stack += item
    return total


class Method:
    """A method of a value, callable within the bounds.

    Args:
        owner: The value.
        name: The method.
        budget: What calling it is charged to.

    Raises:
        ExpressionError: Values of that type have no such method, or it may not be called.
    """

    def __init__(self, owner: Any, name: str, budget: Budget) -> None:
        allowed = _METHODS.get(type(owner), frozenset())
        if name not in allowed:
            known = f"; it has {', '.join(sorted(allowed))}" if allowed else ""
            raise ExpressionError(f"'.{name}' of a {type(owner).__name__} is not available{known}")
        self._owner = owner
        self._name = name
        self._budget = budget

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the method."""
        self._budget.settle((self._owner, args))
        if self._name == "format":
            return _Formatter(self._budget).vformat(self._owner, args, kwargs)
        if self._name in {"center", "ljust", "rjust", "zfill"}:
            _check_width(max((a for a in args if isinstance(a, int)), default=0))
        if self._name == "join" and args:
            parts = list(args[0])
            self._budget.repeat(self._owner, len(parts))
            args = (parts,)
        if self._name == "replace" and len(args) > 1 and isinstance(args[1], str):
            self._budget.repeat(args[1], len(self._owner) + 1)
        result = getattr(self._owner, self._name)(*args, **kwargs)
        return list(result) if self._name in {"items", "keys", "values"} else result


class _Formatter(string.Formatter):
    """``str.format`` without attributes and without wide fields."""

    def __init__(self, budget: Budget) -> None:
        self._budget = budget

    def get_field(
        self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> tuple[Any, Any]:
        if "." in field_name:
            raise ExpressionError(f"'{{{field_name}}}' reaches for an attribute")
        found: tuple[Any, Any] = super().get_field(field_name, args, kwargs)
        return found

    def format_field(self, value: Any, format_spec: str) -> str:
        return _format(self._budget, value, format_spec)


def _check_width(width: int) -> None:
    if width > _MAX_WIDTH:
        raise ExpressionError(f"it makes a field wider than {_MAX_WIDTH}")


def check_pattern(pattern: str) -> None:
    """Refuse a ``%`` pattern with wide fields.

    Raises:
        ExpressionError: A width is too large, or is taken from a value (``*``).
    """
    if _WIDE_PERCENT.search(pattern):
        _check_width(_MAX_WIDTH + 1)
    if _STAR_PERCENT.search(pattern):
        raise ExpressionError("a field width from a value ('*') is not available")


def _format(budget: Budget, value: Any, spec: str = "") -> str:
    if _WIDE.search(spec):
        _check_width(_MAX_WIDTH + 1)
    if not isinstance(value, _PLAIN):
        return str(value)
    text = format(value, spec)
    budget.charge(len(text) // 64)
    return text


def power(budget: Budget, base: Any, exponent: Any) -> Any:
    """Raise to a power, within the bounds."""
    if isinstance(base, int) and isinstance(exponent, int) and exponent > 0:
        budget.bits(base.bit_length() * exponent)
    return base**exponent


def _range(budget: Budget, *args: int) -> range:
    numbers = range(*args)
    try:
        budget.charge(len(numbers))
    except OverflowError:
        budget.bits(math.inf)
    return numbers


def _round(_budget: Budget, number: Any, digits: int | None = None) -> Any:
    if digits is not None and abs(digits) > _MAX_DIGITS:
        raise ExpressionError(f"it rounds to more than {_MAX_DIGITS} digits")
    return round(number, digits)


def _combinatoric(function: Callable[..., int]) -> Callable[..., int]:
    def bounded(budget: Budget, number: int, *chosen: int) -> int:
        budget.bits(number * math.log2(max(number, 2)))
        return function(number, *chosen)

    return bounded


def _eager(function: Callable[..., Any]) -> Callable[..., list[Any]]:
    def bounded(budget: Budget, *args: Any, **kwargs: Any) -> list[Any]:
        result: list[Any] = budget.settle(list(function(*args, **kwargs)))
        return result

    return bounded


def _multiple(budget: Budget, *numbers: int) -> int:
    budget.bits(sum(number.bit_length() for number in numbers))
    return math.lcm(*numbers)


def _product(budget: Budget, numbers: Any, *, start: Any = 1) -> Any:
    for number in numbers:
        if isinstance(start, int) and isinstance(number, int):
            budget.bits(start.bit_length() + number.bit_length())
        start *= number
    return start


def _sum(budget: Budget, numbers: Any, start: Any = 0) -> Any:
    for number in numbers:
        start = budget.settle(start + number)
    return start


_BOUNDED: Mapping[str, Callable[..., Any]] = {
    "comb": _combinatoric(math.comb),
    "enumerate": _eager(enumerate),
    "factorial": _combinatoric(math.factorial),
    "filter": _eager(filter),
    "format": _format,
    "lcm": _multiple,
    "map": _eager(map),
    "perm": _combinatoric(math.perm),
    "prod": _product,
    "range": _range,
    "reversed": _eager(reversed),
    "round": _round,
    "sum": _sum,
    "zip": _eager(zip),
}

_BUILTINS: Mapping[str, Callable[..., Any]] = {
    function.__name__: function
    for function in (
        *(abs, all, any, bin, bool, chr, complex, dict, divmod, float, frozenset, hex, int),
        *(isinstance, len, list, max, min, oct, ord, repr, set, slice, sorted, str, tuple),
    )
}


def functions(budget: Budget) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the names that come before args (those of ``math``) and those that come after."""

    def bind(function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *args, **kwargs: function(budget, *args, **kwargs)

    before: dict[str, Any] = {"true": True, "false": False}
    for name, value in vars(math).items():
        if not name.startswith("_"):
            before[name] = bind(_BOUNDED[name]) if name in _BOUNDED else value
    after = {name: bind(function) for name, function in _BOUNDED.items() if name not in vars(math)}
    return before, {**_BUILTINS, **after}
