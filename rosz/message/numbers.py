"""Numeric sequences: whatever a caller gives, as a buffer of the right element type."""

from __future__ import annotations

from array import array
from math import inf
from typing import Any

__all__ = ("flags", "numbers", "octets")

_FLOATS = frozenset("fd")
_OCTET_FORMATS = frozenset({"B", "b", "c", "?"})


def numbers(value: Any, code: str, size: int = -1) -> array[Any] | memoryview:
    """Return the numbers as a flat buffer whose ``len`` is their count.

    Buffers of the right type (``array.array``, numpy arrays of any shape) are not copied; other
    sequences are converted, number by number.

    Args:
        value: The sequence.
        code: Element type, as the ``array`` module spells it.
        size: How many there must be, -1 for any number.

    Raises:
        TypeError: It is no sequence of such numbers.
        OverflowError: A number is outside the range of the type.
        ValueError: There are too many or too few.
    """
    found = _view(value, code)
    if found is None:
        if isinstance(value, str | bytes | bytearray | dict | set):
            raise TypeError(f"'{type(value).__name__}' is no sequence of numbers")
        _refuse_once(value)
        plain = _flat(value.tolist()) if hasattr(value, "tolist") else list(value)
        found = array(code, plain)
        if code == "f":
            _refuse_overflow(found, plain)
    if len(found) != size >= 0:
        raise ValueError(f"expected {size} elements, got {len(found)}")
    return found


def _view(value: Any, code: str) -> array[Any] | memoryview | None:
    """Return a buffer of just that type as it is."""
    if type(value) is array and value.typecode == code:
        return value
    try:
        view = memoryview(value)
    except TypeError:
        return None
    if not view.c_contiguous or view.itemsize != array(code).itemsize:
        return None
    given = view.format.lstrip("@=<")
    if given != code and given not in _SAME.get(code, ""):
        return None
    if view.nbytes == 0:
        return array(code)
    flat: memoryview = view.cast("B").cast(code)  # type: ignore[call-overload]
    return flat


_SAME = {"q": "l", "Q": "L", "i": "l", "I": "L"}
"""Formats that mean the same where their size is the same: C's long."""


def _flat(values: Any) -> list[Any]:
    """Flatten what a numpy array of several dimensions gave."""
    if values and isinstance(values[0], list):
        return [number for row in values for number in _flat(row)]
    plain: list[Any] = values
    return plain


def _listed(value: Any) -> list[Any]:
    """Return what a buffer of some other element type holds."""
    try:
        numbers: list[Any] = value.tolist()
    except NotImplementedError as error:  # a memoryview of what only numpy reads
        raise TypeError(str(error)) from None
    return numbers


def _refuse_once(value: Any) -> None:
    """Object to what can be read but once: a message is encoded as often as it is wanted."""
    if not hasattr(value, "__len__"):
        raise TypeError(f"'{type(value).__name__}' is no sequence")


def _refuse_overflow(found: array[float], given: list[Any]) -> None:
    """Object to float32 values that became infinite only by their conversion."""
    if inf in found or -inf in found:
        for before, after in zip(given, found, strict=True):
            if after in (inf, -inf) and before not in (inf, -inf):
                raise OverflowError(f"{before!r} is outside the range of float32")


def octets(value: Any, size: int = -1) -> bytes | memoryview:
    """Return octets as a buffer.

    Raises:
        TypeError: It is no sequence of integers.
        ValueError: A number is not in 0..255, or there are too many or too few.
    """
    found: bytes | memoryview
    if type(value) is bytes:
        found = value
    else:
        try:
            view = memoryview(value)
        except TypeError:
            if isinstance(value, str | int | dict | set):
                raise
            _refuse_once(value)
            found = bytes(value)
        else:
            if view.format in _OCTET_FORMATS and view.c_contiguous:
                found = view.cast("B") if view.nbytes else b""
            else:
                found = bytes(_flat(_listed(value)))
    if len(found) != size >= 0:
        raise ValueError(f"expected {size} elements, got {len(found)}")
    return found


def flags(value: Any, size: int = -1) -> bytes:
    """Return truth values as octets 0 and 1.

    Raises:
        TypeError: It is no sequence.
        ValueError: There are too many or too few.
    """
    if isinstance(value, str | dict | set):
        raise TypeError(f"'{type(value).__name__}' is no sequence of truth values")
    _refuse_once(value)
    found = bytes(map(bool, value))
    if len(found) != size >= 0:
        raise ValueError(f"expected {size} elements, got {len(found)}")
    return found
