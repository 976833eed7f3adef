"""Vectors, and the way to numpy, which is loaded when the first result needs it."""

from __future__ import annotations

from typing import Any, TypeAlias

__all__ = ("EPSILON", "Array", "Numbers", "numpy", "random_vector", "unit_vector", "vector_norm")

Array: TypeAlias = Any
"""A numpy array of floats."""

Numbers: TypeAlias = Any
"""A sequence of numbers, of sequences of them, or an array."""

EPSILON = 2.0**-50
"""What counts as zero beside 1: four times the distance from 1 to the next float."""


def numpy() -> Any:
    """Return numpy.

    Raises:
        ModuleNotFoundError: It is not installed; the text says how to get it.
    """
    try:
        import numpy as np
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "tf.transformations gives numpy arrays, and numpy is not installed; run:"
            " pip install 'rosz[numpy]'",
            name=error.name,
        ) from error
    return np


def vector_norm(data: Numbers, axis: int | None = None, out: Array = None) -> Any:
    """Return the length of a vector, or an array of lengths.

    Args:
        data: The vector, or an array of several.
        axis: Along which to measure; everything is one vector when not given.
        out: An array to put the lengths into; nothing is returned then.
    """
    np = numpy()
    values = np.array(data, dtype=float)
    lengths = np.sqrt(np.sum(np.square(values), axis=axis))
    if out is None:
        return lengths if values.ndim == 1 else np.atleast_1d(lengths)
    out[...] = lengths
    return None


def unit_vector(data: Numbers, axis: int | None = None, out: Array = None) -> Array:
    """Return a vector of the same direction and length 1, or such vectors along an axis.

    Args:
        data: The vector or array.
        axis: Along which to measure; everything is one vector when not given.
        out: An array to put the result into; nothing is returned then.
    """
    np = numpy()
    values = np.array(data, dtype=float)
    lengths = np.sqrt(np.sum(np.square(values), axis=axis, keepdims=axis is not None))
    with np.errstate(invalid="ignore", divide="ignore"):
        values = values / lengths
    if out is None:
        return values
    out[...] = values
    return None


def random_vector(size: int) -> Array:
    """Return numbers from 0 to 1, below 1, that are drawn anew each time."""
    return numpy().random.random(size)
