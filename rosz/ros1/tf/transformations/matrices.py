"""4x4 matrices: single transformations, their composition and their decomposition."""

from __future__ import annotations

import math
from typing import Any

from rosz.ros1.tf.transformations.rotations import (
    EPSILON,
    Array,
    Numbers,
    euler_from_matrix,
    euler_matrix,
    numpy,
    quaternion_matrix,
    random_quaternion,
    unit_vector,
)

__all__ = (
    "compose_matrix",
    "concatenate_matrices",
    "decompose_matrix",
    "identity_matrix",
    "inverse_matrix",
    "is_same_transform",
    "orthogonalization_matrix",
    "projection_matrix",
    "random_rotation_matrix",
    "reflection_from_matrix",
    "reflection_matrix",
    "rotation_from_matrix",
    "rotation_matrix",
    "scale_from_matrix",
    "scale_matrix",
    "shear_matrix",
    "superimposition_matrix",
    "translation_from_matrix",
    "translation_matrix",
)


def identity_matrix() -> Array:
    """Return the identity matrix."""
    return numpy().identity(4)


def translation_matrix(direction: Numbers) -> Array:
    """Return the matrix of a translation by a vector."""
    matrix = identity_matrix()
    matrix[:3, 3] = direction[:3]
    return matrix


def translation_from_matrix(matrix: Numbers) -> Array:
    """Return the translation vector of a matrix."""
    return numpy().array(matrix)[:3, 3].copy()


def reflection_matrix(point: Numbers, normal: Numbers) -> Array:
    """Return the matrix of a reflection at a plane.

    Args:
        point: Point of the plane.
        normal: Normal of the plane, of any length.
    """
    np = numpy()
    axis = unit_vector(normal[:3])
    matrix = identity_matrix()
    matrix[:3, :3] -= 2.0 * np.outer(axis, axis)
    matrix[:3, 3] = 2.0 * np.dot(point[:3], axis) * axis
    return matrix


def rotation_matrix(angle: float, direction: Numbers, point: Numbers = None) -> Array:
    """Return the matrix of a rotation about an axis.

    Args:
        angle: Angle in radians.
        direction: Direction of the axis, of any length.
        point: Point of the axis; the origin when not given.
    """
    np = numpy()
    axis = unit_vector(direction[:3])
    x, y, z = axis
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    cosine = math.cos(angle)
    matrix = identity_matrix()
    matrix[:3, :3] = (
        cosine * np.identity(3) + math.sin(angle) * cross + (1.0 - cosine) * np.outer(axis, axis)
    )
    if point is not None:
        fixed = np.array(point[:3], dtype=float)
        matrix[:3, 3] = fixed - matrix[:3, :3] @ fixed
    return matrix


def scale_matrix(factor: float, origin: Numbers = None, direction: Numbers = None) -> Array:
    """Return the matrix of a scaling; the factor -1 reflects at a point.

    Args:
        factor: Scale factor.
        origin: Fixed point; the origin when not given.
        direction: Only direction to scale in; all directions when not given.
    """
    np = numpy()
    matrix = identity_matrix()
    if direction is None:
        matrix[:3, :3] *= factor
    else:
        axis = unit_vector(direction[:3])
        matrix[:3, :3] -= (1.0 - factor) * np.outer(axis, axis)
    if origin is not None:
        fixed = np.array(origin[:3], dtype=float)
        matrix[:3, 3] = fixed - matrix[:3, :3] @ fixed
    return matrix


def projection_matrix(
    point: Numbers,
    normal: Numbers,
    direction: Numbers = None,
    perspective: Numbers = None,
    pseudo: bool = False,
) -> Array:
    """Return the matrix of a projection onto a plane: orthogonal, oblique or from a point.

    Args:
        point: Point of the plane.
        normal: Normal of the plane, of any length.
        direction: Direction of the projection; the normal when not given.
        perspective: Point to project from, instead of a direction.
        pseudo: With a perspective, whether to keep relative depths.
    """
    np = numpy()
    matrix = identity_matrix()
    base = np.array(point[:3], dtype=float)
    axis = unit_vector(normal[:3])
    if perspective is not None:
        eye = np.array(perspective[:3], dtype=float)
        depth = np.dot(eye - base, axis)
        matrix[:3, :3] *= depth
        matrix[:3, :3] -= np.outer(eye, axis)
        if pseudo:
            matrix[:3, :3] -= np.outer(axis, axis)
            matrix[:3, 3] = np.dot(base, axis) * (eye + axis)
        else:
            matrix[:3, 3] = np.dot(base, axis) * eye
        matrix[3, :3] = -axis
        matrix[3, 3] = np.dot(eye, axis)
        return matrix
    way = axis if direction is None else np.array(direction[:3], dtype=float)
    scale = np.dot(way, axis)
    matrix[:3, :3] -= np.outer(way, axis) / scale
    matrix[:3, 3] = way * (np.dot(base, axis) / scale)
    return matrix


def shear_matrix(angle: float, direction: Numbers, point: Numbers, normal: Numbers) -> Array:
    """Return the matrix of a shear along a plane.

    Args:
        angle: Angle in radians.
        direction: Direction of the shear, orthogonal to the normal.
        point: Point of the fixed plane.
        normal: Normal of the fixed plane.

    Raises:
        ValueError: The direction and the normal are not orthogonal.
    """
    np = numpy()
    axis, way = unit_vector(normal[:3]), unit_vector(direction[:3])
    slant = abs(float(np.dot(axis, way)))
    if slant > 1e-6:  # noqa: PLR2004  # ROS 1's
        raise ValueError(f"direction and normal are not orthogonal: their product is {slant:g}")
    matrix = identity_matrix()
    matrix[:3, :3] += math.tan(angle) * np.outer(way, axis)
    matrix[:3, 3] = -math.tan(angle) * np.dot(point[:3], axis) * way
    return matrix


def orthogonalization_matrix(lengths: Numbers, angles: Numbers) -> Array:
    """Return the matrix from crystallographic to orthogonal coordinates.

    Args:
        lengths: Lengths of the edges of the cell.
        angles: Angles of the cell in degrees.
    """
    np = numpy()
    a, b, c = lengths
    alpha, beta, gamma = (math.radians(angle) for angle in angles)
    sin_a, sin_b = math.sin(alpha), math.sin(beta)
    cos_a, cos_b, cos_g = math.cos(alpha), math.cos(beta), math.cos(gamma)
    shared = (cos_a * cos_b - cos_g) / (sin_a * sin_b)
    return np.array(
        (
            (a * sin_b * math.sqrt(1.0 - shared * shared), 0.0, 0.0, 0.0),
            (-a * sin_b * shared, b * sin_a, 0.0, 0.0),
            (a * cos_b, b * cos_a, c, 0.0),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def random_rotation_matrix(rand: Numbers = None) -> Array:
    """Return a random rotation; see `random_quaternion`."""
    return quaternion_matrix(random_quaternion(rand))


def concatenate_matrices(*matrices: Numbers) -> Array:
    """Return the product of matrices, which applies the last one first."""
    np = numpy()
    whole = identity_matrix()
    for matrix in matrices:
        whole = whole @ np.array(matrix, dtype=float)
    return whole


def inverse_matrix(matrix: Numbers) -> Array:
    """Return the inverse of a matrix."""
    return numpy().linalg.inv(matrix)


def is_same_transform(matrix0: Numbers, matrix1: Numbers) -> bool:
    """Return whether two matrices are the same transformation, apart from scale."""
    np = numpy()
    one, two = np.array(matrix0, dtype=float), np.array(matrix1, dtype=float)
    return bool(np.allclose(one / one[3, 3], two / two[3, 3]))


_CLOSE = 1e-8


def _eigenvector(matrix: Array, value: float, *, last: bool = True) -> Array:
    """Return an eigenvector of an eigenvalue.

    Raises:
        ValueError: The matrix has no such eigenvalue.
    """
    np = numpy()
    values, vectors = np.linalg.eig(matrix)
    (found,) = np.nonzero(abs(np.real(values) - value) < _CLOSE)
    if not len(found):
        raise ValueError(f"no eigenvector corresponding to eigenvalue {value:g}")
    return np.real(vectors[:, found[-1 if last else 0]]).squeeze()


def _fixed_point(matrix: Array) -> Array:
    """Return a fixed point of a matrix in homogeneous coordinates."""
    point = _eigenvector(matrix, 1.0)
    return point / point[3]


def reflection_from_matrix(matrix: Numbers) -> tuple[Array, Array]:
    """Return a point and the normal of the plane of a reflection.

    Raises:
        ValueError: The matrix is not a reflection.
    """
    m = numpy().array(matrix, dtype=float)
    return _fixed_point(m), _eigenvector(m[:3, :3], -1.0, last=False)


def rotation_from_matrix(matrix: Numbers) -> tuple[float, Array, Array]:
    """Return the angle, the direction of the axis and a point of the axis of a rotation.

    Raises:
        ValueError: The matrix is not a rotation.
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
    """Return factor, origin and direction of a scaling; None if it scales in all directions.

    Raises:
        ValueError: The matrix is not a scaling.
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
    """Decompose a matrix into single transformations.

    Returns:
        Scale along the axes, shear (xy, xz, yz), Euler angles ``sxyz``, translation, perspective.

    Raises:
        ValueError: The matrix is singular.
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
    rows, scale, shear = _orthogonalize(m[:3, :3].copy())
    angles = list(euler_from_matrix(rows.T))
    return scale, shear, angles, translation, perspective


def _orthogonalize(rows: Array) -> tuple[Array, list[float], list[float]]:
    """Make rows orthogonal, one after the other; return them, scale and shear."""
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
    if np.dot(rows[0], np.cross(rows[1], rows[2])) < 0:  # contains a reflection
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
    """Compose a matrix of the parts that `decompose_matrix` returns; all are optional."""
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
    """Return the matrix that best maps points to other points, by least squares (Kabsch).

    Args:
        v0: Points as an array of 3 rows, with one column for each point.
        v1: Target points.
        scaling: Whether the matrix may scale.
        usesvd: Not used; both methods of ROS 1 have the same result.
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
