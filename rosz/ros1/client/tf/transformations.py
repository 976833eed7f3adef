"""tf.transformations: rotations, quaternions and 4x4 matrices (ROS wiki, tf/transformations).

Quaternions are ``[x, y, z, w]``; matrices act on column vectors; angles are radians. Results are
numpy arrays as in ROS 1; functions that return one need the extra ``rosz[numpy]``.

``Arcball`` and its helpers, ``clip_matrix``, ``projection_from_matrix`` and ``shear_from_matrix``
are missing.
"""

from __future__ import annotations

import math
from math import cos, sin
from typing import Any, TypeAlias

from rosz.ros1.client.tf.euler import (
    EPSILON,
    Axes,
    Numbers,
    euler_from_matrix,
    euler_from_quaternion,
    resolve_order,
    rotation_rows,
)

__all__ = (
    "compose_matrix",
    "concatenate_matrices",
    "decompose_matrix",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_matrix",
    "identity_matrix",
    "inverse_matrix",
    "is_same_transform",
    "math",
    "numpy",
    "orthogonalization_matrix",
    "projection_matrix",
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "random_rotation_matrix",
    "random_vector",
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
    "unit_vector",
    "vector_norm",
)

Array: TypeAlias = Any
"""A numpy array of floats."""


class _Numpy:
    """numpy, which is imported when a function first needs it."""

    def __getattr__(self, name: str) -> Any:
        try:
            import numpy  # noqa: ICN001  # `np` is this object
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "tf.transformations returns numpy arrays, and numpy is not installed; run:"
                " pip install 'rosz[numpy]'",
                name=error.name,
            ) from error
        return getattr(numpy, name)


np: Any = _Numpy()
numpy = np  # ROS 1's module has no __all__: `import *` gives its users math and numpy, too


def vector_norm(data: Numbers, axis: int | None = None, out: Array = None) -> Any:
    """Return the length of a vector, or an array of lengths.

    Args:
        data: The vector, or an array of several.
        axis: Axis of the vectors; the whole array is one vector when not given.
        out: Array for the lengths; nothing is returned then.
    """
    values = np.array(data, dtype=float)
    lengths = np.linalg.norm(values, axis=axis)
    if out is None:
        return lengths if values.ndim == 1 else np.atleast_1d(lengths)
    out[...] = lengths
    return None


def unit_vector(data: Numbers, axis: int | None = None, out: Array = None) -> Array:
    """Return vectors of the same direction and of length 1; see `vector_norm`."""
    values = np.array(data, dtype=float)
    lengths = np.linalg.norm(values, axis=axis, keepdims=axis is not None)
    with np.errstate(invalid="ignore", divide="ignore"):
        values = values / lengths
    if out is None:
        return values
    out[...] = values
    return None


def random_vector(size: int) -> Array:
    """Return random numbers from 0, included, to 1, excluded."""
    return np.random.random(size)


def _product(left: Numbers, right: Numbers) -> tuple[float, ...]:
    ax, ay, az, aw = left
    bx, by, bz, bw = right
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def quaternion_multiply(quaternion1: Numbers, quaternion0: Numbers) -> Array:
    """Return the rotation that applies the second one first, then the first one."""
    return np.array(_product(quaternion1, quaternion0), dtype=float)


def quaternion_conjugate(quaternion: Numbers) -> Array:
    """Return the quaternion with its vector part negated."""
    return np.array(quaternion, dtype=float) * (-1.0, -1.0, -1.0, 1.0)


def quaternion_inverse(quaternion: Numbers) -> Array:
    """Return the inverse of a quaternion of any length."""
    conjugate = quaternion_conjugate(quaternion)
    return conjugate / conjugate.dot(conjugate)


def quaternion_about_axis(angle: float, axis: Numbers) -> Array:
    """Return the rotation by an angle about an axis of any length."""
    direction = np.array(axis, dtype=float)[:3]
    length = np.linalg.norm(direction)
    scale = sin(angle / 2.0) / length if length > EPSILON else 1.0
    return np.array((*direction * scale, cos(angle / 2.0)))


def quaternion_matrix(quaternion: Numbers) -> Array:
    """Return the 4x4 matrix of a rotation."""
    matrix = identity_matrix()
    matrix[:3, :3] = rotation_rows(quaternion)
    return matrix


def quaternion_from_matrix(matrix: Numbers) -> Array:
    """Return the rotation of a 4x4 matrix, calculated from its largest part."""
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
    start, end = unit_vector(tuple(quat0)[:4]), unit_vector(tuple(quat1)[:4])
    if fraction == 0.0:
        return start
    if fraction == 1.0:
        return end
    cosine = float(start.dot(end))
    if abs(abs(cosine) - 1.0) < EPSILON:
        return start
    if shortestpath and cosine < 0.0:
        cosine, end = -cosine, -end
    angle = math.acos(cosine) + spin * math.pi
    if abs(angle) < EPSILON:
        return start
    early, late = sin((1.0 - fraction) * angle), sin(fraction * angle)
    return (start * early + end * late) / sin(angle)


def random_quaternion(rand: Numbers = None) -> Array:
    """Return a random rotation of uniform distribution (Shoemake, Graphics Gems III).

    Args:
        rand: Three numbers from 0 to 1; random when not given.
    """
    share, turn0, turn1 = np.random.random(3) if rand is None else rand
    low, high = math.sqrt(1.0 - share), math.sqrt(share)
    first, second = 2.0 * math.pi * turn0, 2.0 * math.pi * turn1
    return np.array((low * sin(first), low * cos(first), high * sin(second), high * cos(second)))


def _rotations(ai: float, aj: float, ak: float, axes: Axes) -> list[tuple[int, float]]:
    """Return the rotations as axes and angles, in the order in which matrices are multiplied."""
    order, moving = resolve_order(axes)
    turns = list(zip(order, (ai, aj, ak), strict=True))
    return turns if moving else turns[::-1]


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
    whole: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in _rotations(ai, aj, ak, axes):
        turn = [0.0, 0.0, 0.0, cos(angle / 2.0)]
        turn[axis] = sin(angle / 2.0)
        whole = _product(whole, turn)
    return np.array(whole)


def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> Array:
    """Return the 4x4 matrix of three Euler angles; see `quaternion_from_euler`."""
    whole = identity_matrix()
    for axis, angle in _rotations(ai, aj, ak, axes):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = identity_matrix()
        turn[j, j] = turn[k, k] = cos(angle)
        turn[k, j], turn[j, k] = sin(angle), -sin(angle)
        whole = whole @ turn
    return whole


def identity_matrix() -> Array:
    """Return the identity matrix."""
    return np.identity(4)


def translation_matrix(direction: Numbers) -> Array:
    """Return the matrix of a translation by a vector."""
    matrix = identity_matrix()
    matrix[:3, 3] = direction[:3]
    return matrix


def translation_from_matrix(matrix: Numbers) -> Array:
    """Return the translation vector of a matrix."""
    return np.array(matrix)[:3, 3].copy()


def reflection_matrix(point: Numbers, normal: Numbers) -> Array:
    """Return the matrix of a reflection at a plane.

    Args:
        point: Point of the plane.
        normal: Normal of the plane, of any length.
    """
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
    axis = unit_vector(direction[:3])
    x, y, z = axis
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    cosine = cos(angle)
    matrix = identity_matrix()
    matrix[:3, :3] = (
        cosine * np.identity(3) + sin(angle) * cross + (1.0 - cosine) * np.outer(axis, axis)
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
    a, b, c = lengths
    alpha, beta, gamma = (math.radians(angle) for angle in angles)
    sin_a, sin_b = sin(alpha), sin(beta)
    cos_a, cos_b, cos_g = cos(alpha), cos(beta), cos(gamma)
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
    whole = identity_matrix()
    for matrix in matrices:
        whole = whole @ np.array(matrix, dtype=float)
    return whole


def inverse_matrix(matrix: Numbers) -> Array:
    """Return the inverse of a matrix."""
    return np.linalg.inv(matrix)


def is_same_transform(matrix0: Numbers, matrix1: Numbers) -> bool:
    """Return whether two matrices are the same transformation, apart from scale."""
    m0, m1 = np.array(matrix0, dtype=float), np.array(matrix1, dtype=float)
    return bool(np.allclose(m0 / m0[3, 3], m1 / m1[3, 3]))


_CLOSE = 1e-8


def _eigenvector(matrix: Array, value: float, *, last: bool = True) -> Array:
    """Return an eigenvector of an eigenvalue, or raise a ValueError if there is none."""
    values, vectors = np.linalg.eig(matrix)
    (indices,) = np.nonzero(abs(np.real(values) - value) < _CLOSE)
    if not len(indices):
        raise ValueError(f"no eigenvector corresponding to eigenvalue {value:g}")
    return np.real(vectors[:, indices[-1 if last else 0]]).squeeze()


def _fixed_point(matrix: Array) -> Array:
    point = _eigenvector(matrix, 1.0)
    return point / point[3]


def reflection_from_matrix(matrix: Numbers) -> tuple[Array, Array]:
    """Return a point and the normal of the plane of a reflection.

    Raises:
        ValueError: The matrix is not a reflection.
    """
    m = np.array(matrix, dtype=float)
    return _fixed_point(m), _eigenvector(m[:3, :3], -1.0, last=False)


def rotation_from_matrix(matrix: Numbers) -> tuple[float, Array, Array]:
    """Return the angle, the direction of the axis and a point of the axis of a rotation.

    Raises:
        ValueError: The matrix is not a rotation.
    """
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
    m = np.array(matrix, dtype=float)
    factor = float(np.trace(m[:3, :3])) - 2.0
    try:
        direction: Array | None = _eigenvector(m[:3, :3], factor, last=False)
    except ValueError:
        factor = (factor + 2.0) / 3.0
        direction = None
    else:
        direction = unit_vector(direction)
    return factor, _fixed_point(m), direction


def decompose_matrix(matrix: Numbers) -> tuple[Array, list[float], list[float], Array, Array]:
    """Decompose a matrix into single transformations.

    Returns:
        Scale along the axes, shear (xy, xz, yz), Euler angles ``sxyz``, translation, perspective.

    Raises:
        ValueError: The matrix is singular.
    """
    m = np.array(matrix, dtype=float)
    if abs(m[3, 3]) < EPSILON:
        raise ValueError("M[3, 3] is zero")
    m /= m[3, 3]
    affine = m.copy()
    affine[3] = 0.0, 0.0, 0.0, 1.0
    if abs(np.linalg.det(affine)) < EPSILON:
        raise ValueError("Matrix is singular")
    perspective = affine[3]
    if any(abs(m[3, :3]) > EPSILON):
        perspective = m[3] @ np.linalg.inv(affine)
    # The linear part is a rotation times a triangular matrix with the scale on its diagonal.
    turn, mixed = np.linalg.qr(m[:3, :3])
    signs = np.sign(np.diag(mixed))
    turn, mixed = turn * signs, mixed * signs[:, None]
    scale = np.diag(mixed)
    shear = [float(mixed[i, k] / scale[k]) for i, k in ((0, 1), (0, 2), (1, 2))]
    if np.linalg.det(turn) < 0:  # contains a reflection
        scale, turn = -scale, -turn
    return scale, shear, list(euler_from_matrix(turn)), m[:3, 3].copy(), perspective


def compose_matrix(
    scale: Numbers = None,
    shear: Numbers = None,
    angles: Numbers = None,
    translate: Numbers = None,
    perspective: Numbers = None,
) -> Array:
    """Compose a matrix of the parts that `decompose_matrix` returns; all are optional."""
    matrix = identity_matrix()
    if perspective is not None:
        matrix[3] = perspective[:4]
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
    before, after = (np.array(points, dtype=float)[:3] for points in (v0, v1))
    middle, target = before.mean(axis=1), after.mean(axis=1)
    before, after = before - middle[:, None], after - target[:, None]
    left, _, right = np.linalg.svd(after @ before.T)
    mirror = np.diag((1.0, 1.0, 1.0 if np.linalg.det(left @ right) > 0 else -1.0))
    turn = left @ mirror @ right
    if scaling:
        turn = turn * math.sqrt(float(np.sum(after**2) / np.sum(before**2)))
    matrix = identity_matrix()
    matrix[:3, :3] = turn
    matrix[:3, 3] = target - turn @ middle
    return matrix
