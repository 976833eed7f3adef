"""tf.transformations: rotations, quaternions and 4x4 matrices (ROS wiki, tf/transformations).

Quaternions are ``[x, y, z, w]``; matrices act on column vectors; angles are radians. Results are
numpy arrays as in ROS 1. Most functions are those of the library ``transformations``, of which
ROS 1 has an early version; they need the extra ``rosz[numpy]``. The quaternions of the library are
``[w, x, y, z]``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeAlias

from rosz.ros1.client.tf.euler import (
    Axes,
    Numbers,
    euler_from_matrix,
    euler_from_quaternion,
    resolve_order,
)

__all__ = (
    "Arcball", "arcball_constrain_to_axis", "arcball_map_to_sphere", "arcball_nearest_axis",
    "clip_matrix", "compose_matrix", "concatenate_matrices", "decompose_matrix",
    "euler_from_matrix", "euler_from_quaternion", "euler_matrix", "identity_matrix",
    "inverse_matrix", "is_same_transform", "math", "numpy", "orthogonalization_matrix",
    "projection_from_matrix", "projection_matrix", "quaternion_about_axis",
    "quaternion_conjugate", "quaternion_from_euler", "quaternion_from_matrix",
    "quaternion_inverse", "quaternion_matrix", "quaternion_multiply", "quaternion_slerp",
    "random_quaternion", "random_rotation_matrix", "random_vector", "reflection_from_matrix",
    "reflection_matrix", "rotation_from_matrix", "rotation_matrix", "scale_from_matrix",
    "scale_matrix", "shear_from_matrix", "shear_matrix", "superimposition_matrix",
    "translation_from_matrix", "translation_matrix", "unit_vector", "vector_norm",
)  # fmt: skip

Array: TypeAlias = Any
"""A numpy array of floats."""


class _Library:
    """A library, which is imported when a function first needs it.

    The functions in C of ``transformations`` differ from ROS 1's for directions that are not of
    length 1, so those in Python, whose names end with ``_py``, come first.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        try:
            library = import_module(self._name)
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                f"tf.transformations needs the library {self._name}, which is not installed; run:"
                " pip install 'rosz[numpy]'",
                name=error.name,
            ) from error
        return getattr(library, f"{name}_py", None) or getattr(library, name)


np: Any = _Library("numpy")
numpy = np  # ROS 1's module has no __all__: `import *` gives its users math and numpy, too
_library: Any = _Library("transformations.transformations")


def _function(name: str) -> Callable[..., Any]:
    def function(*arguments: Any, **keywords: Any) -> Any:
        return getattr(_library, name)(*arguments, **keywords)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"See the function of this name in the library ``transformations``: {name}."
    return function


def Arcball(initial: Numbers = None) -> Any:  # noqa: N802  # ROS 1's class
    """Return a ball that a pointer turns; see the class in the library ``transformations``.

    Args:
        initial: First rotation, a quaternion or a matrix; none when not given.
    """
    if np.shape(initial) == (4,):
        initial = _to_library(initial)
    return _library.Arcball(initial)


arcball_constrain_to_axis = _function("arcball_constrain_to_axis")
arcball_map_to_sphere = _function("arcball_map_to_sphere")
arcball_nearest_axis = _function("arcball_nearest_axis")
compose_matrix = _function("compose_matrix")
concatenate_matrices = _function("concatenate_matrices")
decompose_matrix = _function("decompose_matrix")
identity_matrix = _function("identity_matrix")
inverse_matrix = _function("inverse_matrix")
is_same_transform = _function("is_same_transform")
orthogonalization_matrix = _function("orthogonalization_matrix")
projection_matrix = _function("projection_matrix")
random_rotation_matrix = _function("random_rotation_matrix")
random_vector = _function("random_vector")
reflection_from_matrix = _function("reflection_from_matrix")
reflection_matrix = _function("reflection_matrix")
rotation_from_matrix = _function("rotation_from_matrix")
rotation_matrix = _function("rotation_matrix")
scale_from_matrix = _function("scale_from_matrix")
scale_matrix = _function("scale_matrix")
shear_from_matrix = _function("shear_from_matrix")
shear_matrix = _function("shear_matrix")
translation_from_matrix = _function("translation_from_matrix")
translation_matrix = _function("translation_matrix")


def vector_norm(data: Numbers, axis: int | None = None, out: Array = None) -> Any:
    """Return the length of a vector, or an array of lengths.

    Args:
        data: The vector, or an array of several.
        axis: Axis of the vectors; the whole array is one vector when not given.
        out: Array for the lengths; nothing is returned then.
    """
    return _library.vector_norm(data, axis=axis, out=out)


def unit_vector(data: Numbers, axis: int | None = None, out: Array = None) -> Array:
    """Return vectors of the same direction and of length 1; see `vector_norm`."""
    return _library.unit_vector(data, axis=axis, out=out)


def clip_matrix(  # noqa: PLR0917  # the signature of ROS 1
    left: float,
    right: float,
    bottom: float,
    top: float,
    near: float,
    far: float,
    perspective: bool = False,
) -> Array:
    """Return the matrix from a view to a cube: of a box, or of a frustum with a perspective."""
    return _library.clip_matrix(left, right, bottom, top, near, far, perspective=perspective)


def projection_from_matrix(matrix: Numbers, pseudo: bool = False) -> tuple[Array, ...]:
    """Return point, normal, direction, perspective and ``pseudo`` of a `projection_matrix`.

    Raises:
        ValueError: The matrix is not a projection.
    """
    parts: tuple[Array, ...] = _library.projection_from_matrix(matrix, pseudo=pseudo)
    return parts


def superimposition_matrix(
    v0: Numbers, v1: Numbers, scaling: bool = False, usesvd: bool = True
) -> Array:
    """Return the matrix that best maps points to other points, by least squares.

    Args:
        v0: Points as an array of 3 rows, with one column for each point.
        v1: Target points.
        scaling: Whether the matrix may scale.
        usesvd: Whether to calculate by singular values instead of quaternions.
    """
    return _library.superimposition_matrix(v0, v1, scale=scaling, usesvd=usesvd)


def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the 4x4 matrix of three Euler angles; see `quaternion_from_euler`."""
    resolve_order(axes)
    return _library.euler_matrix(ai, aj, ak, axes)


# Quaternions.


def _to_library(quaternion: Numbers) -> tuple[float, ...]:
    x, y, z, w = quaternion[:4]
    return w, x, y, z


def _from_library(quaternion: Array) -> Array:
    return quaternion[[1, 2, 3, 0]]


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the rotation of three Euler angles.

    Args:
        ai: First angle in radians.
        aj: Second angle in radians.
        ak: Third angle in radians.
        axes: Order of axes.

    Returns:
        ``[x, y, z, w]``.

    Raises:
        UsageError: The order does not exist.
    """
    resolve_order(axes)
    return _from_library(_library.quaternion_from_euler(ai, aj, ak, axes))


def quaternion_about_axis(angle: float, axis: Numbers) -> Array:
    """Return the rotation by an angle about an axis of any length."""
    return _from_library(_library.quaternion_about_axis(angle, axis))


def quaternion_matrix(quaternion: Numbers) -> Array:
    """Return the 4x4 matrix of a rotation."""
    return _library.quaternion_matrix(_to_library(quaternion))


def quaternion_from_matrix(matrix: Numbers) -> Array:
    """Return the rotation of a 4x4 matrix, calculated from its largest part.

    The library returns the one of both quaternions of a rotation whose ``w`` is not negative.
    """
    m = np.array(matrix, dtype=float)[:4, :4]
    corner = m[3, 3]
    trace = m.trace()
    quaternion = np.empty(4)
    if trace > corner:
        largest = trace
        quaternion[:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], largest
    else:
        i = 1 if m[1, 1] > m[0, 0] else 0
        i = 2 if m[2, 2] > m[i, i] else i
        j, k = (i + 1) % 3, (i + 2) % 3
        largest = m[i, i] - (m[j, j] + m[k, k]) + corner
        quaternion[i] = largest
        quaternion[j] = m[i, j] + m[j, i]
        quaternion[k] = m[k, i] + m[i, k]
        quaternion[3] = m[k, j] - m[j, k]
    return quaternion * (0.5 / math.sqrt(largest * corner))


def quaternion_multiply(quaternion1: Numbers, quaternion0: Numbers) -> Array:
    """Return the rotation that applies the second one first, then the first one."""
    return _from_library(
        _library.quaternion_multiply(_to_library(quaternion1), _to_library(quaternion0))
    )


def quaternion_conjugate(quaternion: Numbers) -> Array:
    """Return the quaternion with its vector part negated."""
    return _from_library(_library.quaternion_conjugate(_to_library(quaternion)))


def quaternion_inverse(quaternion: Numbers) -> Array:
    """Return the inverse of a quaternion of any length."""
    return _from_library(_library.quaternion_inverse(_to_library(quaternion)))


def quaternion_slerp(
    quat0: Numbers, quat1: Numbers, fraction: float, spin: int = 0, shortestpath: bool = True
) -> Array:
    """Interpolate between two rotations at constant angular speed.

    Args:
        quat0: The rotation at fraction 0.
        quat1: The rotation at fraction 1.
        fraction: Position between the two.
        spin: Additional half turns.
        shortestpath: Whether to rotate by the smaller of the two angles.
    """
    start, end = _to_library(quat0), _to_library(quat1)
    slerp = _library.quaternion_slerp
    return _from_library(slerp(start, end, fraction, spin, shortestpath=shortestpath))


def random_quaternion(rand: Numbers = None) -> Array:
    """Return a random rotation of uniform distribution.

    Args:
        rand: Three numbers from 0 to 1; random when not given.
    """
    return _from_library(_library.random_quaternion(rand))
