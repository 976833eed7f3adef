"""What a 4x4 matrix is made of."""

from __future__ import annotations

import math
from typing import Any

from rosz.ros1.tf.transformations.euler import euler_from_matrix, euler_matrix
from rosz.ros1.tf.transformations.matrices import identity_matrix, translation_matrix
from rosz.ros1.tf.transformations.vectors import EPSILON, Array, Numbers, numpy

__all__ = (
    "compose_matrix",
    "decompose_matrix",
    "reflection_from_matrix",
    "rotation_from_matrix",
    "scale_from_matrix",
    "superimposition_matrix",
)

_CLOSE = 1e-8


def _eigenvector(matrix: Array, value: float, *, last: bool = True) -> Array:
    """Return an eigenvector of a value.

    Raises:
        ValueError: The matrix has no such value.
    """
    np = numpy()
    values, vectors = np.linalg.eig(matrix)
    (found,) = np.nonzero(abs(np.real(values) - value) < _CLOSE)
    if not len(found):
        raise ValueError(f"no eigenvector corresponding to eigenvalue {value:g}")
    return np.real(vectors[:, found[-1 if last else 0]]).squeeze()


def _fixed_point(matrix: Array) -> Array:
    """Return a point that a matrix leaves where it is, in four coordinates, the last one 1."""
    point = _eigenvector(matrix, 1.0)
    return point / point[3]


def reflection_from_matrix(matrix: Numbers) -> tuple[Array, Array]:
    """Return point and normal of the plane that a matrix mirrors at.

    Raises:
        ValueError: It is no reflection.
    """
    m = numpy().array(matrix, dtype=float)
    return _fixed_point(m), _eigenvector(m[:3, :3], -1.0, last=False)


def rotation_from_matrix(matrix: Numbers) -> tuple[float, Array, Array]:
    """Return angle, direction of the axis and a point of it.

    Raises:
        ValueError: It is no rotation.
    """
    np = numpy()
    m = np.array(matrix, dtype=float)
    turn = m[:3, :3]
    direction = _eigenvector(turn.T, 1.0)
    cosine = (np.trace(turn) - 1.0) / 2.0
    # The antisymmetric part is the axis, as long as the sine of the angle.
    axis = np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]))
    return math.atan2(float(np.dot(axis, direction)) / 2.0, cosine), direction, _fixed_point(m)


def scale_from_matrix(matrix: Numbers) -> tuple[float, Array, Array | None]:
    """Return factor, origin and direction of a scaling; the direction is None if in all.

    Raises:
        ValueError: It is no scaling.
    """
    np = numpy()
    m = np.array(matrix, dtype=float)
    factor = float(np.trace(m[:3, :3])) - 2.0
    try:
        direction: Array | None = _eigenvector(m[:3, :3], factor, last=False)
    except ValueError:
        factor = (factor + 2.0) / 3.0
        direction = None
    else:
        direction = direction / np.sqrt(np.dot(direction, direction))
    return factor, _fixed_point(m), direction


def decompose_matrix(matrix: Numbers) -> tuple[Array, list[float], list[float], Array, Array]:
    """Return what a matrix is made of.

    Returns:
        Scale along the axes, shear (xy, xz, yz), Euler angles ``sxyz``, translation, perspective.

    Raises:
        ValueError: The matrix makes the space flat.
    """
    np = numpy()
    m = np.array(matrix, dtype=float).T
    if abs(m[3, 3]) < EPSILON:
        raise ValueError("M[3, 3] is zero")
    m /= m[3, 3]
    flat = m.copy()
    flat[:, 3] = 0, 0, 0, 1
    if abs(np.linalg.det(flat)) < EPSILON:
        raise ValueError("Matrix is singular")
    perspective = np.array((0.0, 0.0, 0.0, 1.0))
    if any(abs(m[:3, 3]) > EPSILON):
        perspective = m[:, 3] @ np.linalg.inv(flat.T)
    translation = m[3, :3].copy()
    rows, scale, shear = _straighten(m[:3, :3].copy())
    angles = list(euler_from_matrix(rows.T))
    return scale, shear, angles, translation, perspective


def _straighten(rows: Array) -> tuple[Array, list[float], list[float]]:
    """Make rows stand at right angles, one after the other; return them, scale and shear."""
    np = numpy()
    scale = np.zeros(3)
    scale[0] = np.linalg.norm(rows[0])
    rows[0] /= scale[0]
    xy = np.dot(rows[0], rows[1])
    rows[1] -= rows[0] * xy
    scale[1] = np.linalg.norm(rows[1])
    rows[1] /= scale[1]
    xz = np.dot(rows[0], rows[2])
    rows[2] -= rows[0] * xz
    yz = np.dot(rows[1], rows[2])
    rows[2] -= rows[1] * yz
    scale[2] = np.linalg.norm(rows[2])
    rows[2] /= scale[2]
    if np.dot(rows[0], np.cross(rows[1], rows[2])) < 0:  # a mirror is in it
        scale, rows = -scale, -rows
    xy /= abs(scale[1])
    xz /= abs(scale[2])
    yz /= abs(scale[2])
    return rows, scale, [float(xy), float(xz), float(yz)]


def compose_matrix(
    scale: Numbers = None,
    shear: Numbers = None,
    angles: Numbers = None,
    translate: Numbers = None,
    perspective: Numbers = None,
) -> Array:
    """Return the matrix made of what `decompose_matrix` returns; what is not given is not in it."""
    np = numpy()
    matrix = identity_matrix()
    if perspective is not None:
        part = identity_matrix()
        part[3, :] = perspective[:4]
        matrix = matrix @ part
    if translate is not None:
        matrix = matrix @ translation_matrix(translate)
    if angles is not None:
        matrix = matrix @ euler_matrix(*angles[:3])
    if shear is not None:
        part = identity_matrix()
        part[0, 1], part[0, 2], part[1, 2] = shear
        matrix = matrix @ part
    if scale is not None:
        matrix = matrix @ np.diag([*scale[:3], 1.0])
    return matrix / matrix[3, 3]


def superimposition_matrix(
    v0: Numbers,
    v1: Numbers,
    scaling: bool = False,
    usesvd: bool = True,  # noqa: ARG001  # ROS 1's
) -> Array:
    """Return the matrix that brings points nearest to others, by least squares (Kabsch).

    Args:
        v0: Points, 3 rows and a column for each.
        v1: Where they should be.
        scaling: Whether it may scale.
        usesvd: Not used: both ways of ROS 1 have the same result.
    """
    np = numpy()
    before, after = (np.array(points, dtype=float)[:3] for points in (v0, v1))
    middle, target = before.mean(axis=1), after.mean(axis=1)
    before, after = before - middle[:, None], after - target[:, None]
    left, _, right = np.linalg.svd(after @ before.T)
    mirror: Any = np.diag((1.0, 1.0, 1.0 if np.linalg.det(left @ right) > 0 else -1.0))
    turn = left @ mirror @ right
    if scaling:
        turn = turn * math.sqrt(float(np.sum(after**2) / np.sum(before**2)))
    matrix = identity_matrix()
    matrix[:3, :3] = turn
    matrix[:3, 3] = target - turn @ middle
    return matrix
