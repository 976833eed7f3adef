"""4x4 matrices of single transformations, and how they are joined."""

from __future__ import annotations

import math

from rosz.ros1.tf.transformations.quaternions import quaternion_matrix, random_quaternion
from rosz.ros1.tf.transformations.vectors import Array, Numbers, numpy, unit_vector

__all__ = (
    "concatenate_matrices",
    "identity_matrix",
    "inverse_matrix",
    "is_same_transform",
    "orthogonalization_matrix",
    "projection_matrix",
    "random_rotation_matrix",
    "reflection_matrix",
    "rotation_matrix",
    "scale_matrix",
    "shear_matrix",
    "translation_from_matrix",
    "translation_matrix",
)


def identity_matrix() -> Array:
    """Return the matrix that changes nothing."""
    return numpy().identity(4)


def translation_matrix(direction: Numbers) -> Array:
    """Return the matrix that moves by a vector."""
    matrix = identity_matrix()
    matrix[:3, 3] = direction[:3]
    return matrix


def translation_from_matrix(matrix: Numbers) -> Array:
    """Return the vector that a matrix moves by."""
    return numpy().array(matrix)[:3, 3].copy()


def reflection_matrix(point: Numbers, normal: Numbers) -> Array:
    """Return the matrix that mirrors at a plane.

    Args:
        point: One of the plane.
        normal: Its normal, of any length.
    """
    np = numpy()
    axis = unit_vector(normal[:3])
    matrix = identity_matrix()
    matrix[:3, :3] -= 2.0 * np.outer(axis, axis)
    matrix[:3, 3] = 2.0 * np.dot(point[:3], axis) * axis
    return matrix


def rotation_matrix(angle: float, direction: Numbers, point: Numbers = None) -> Array:
    """Return the matrix that turns about an axis.

    Args:
        angle: Radians.
        direction: Of the axis, of any length.
        point: One of the axis; the origin when not given.
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
    """Return the matrix that scales; by -1 it mirrors at a point.

    Args:
        factor: How much.
        origin: What stays where it is; the origin when not given.
        direction: The only direction to scale in; all when not given.
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
    """Return the matrix that projects onto a plane: at a right angle, aslant, or from a point.

    Args:
        point: One of the plane.
        normal: Its normal, of any length.
        direction: In which to project; along the normal when not given.
        perspective: The point to project from, instead.
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
    """Return the matrix that shears along a plane.

    Args:
        angle: Radians.
        direction: In which to shear; at a right angle to the normal.
        point: One of the plane that stays where it is.
        normal: Of that plane.

    Raises:
        ValueError: The direction and the normal are not at a right angle.
    """
    np = numpy()
    axis, way = unit_vector(normal[:3]), unit_vector(direction[:3])
    slant = abs(float(np.dot(axis, way)))
    if slant > 1e-6:  # noqa: PLR2004  # of ROS 1
        raise ValueError(f"direction and normal are not orthogonal: their product is {slant:g}")
    matrix = identity_matrix()
    matrix[:3, :3] += math.tan(angle) * np.outer(way, axis)
    matrix[:3, 3] = -math.tan(angle) * np.dot(point[:3], axis) * way
    return matrix


def orthogonalization_matrix(lengths: Numbers, angles: Numbers) -> Array:
    """Return the matrix from a crystal's coordinates to right-angled ones.

    Args:
        lengths: Of the edges of the cell.
        angles: Of the cell, in degrees.
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
    """Return a rotation such that all are equally likely; see `random_quaternion`."""
    return quaternion_matrix(random_quaternion(rand))


def concatenate_matrices(*matrices: Numbers) -> Array:
    """Return the product of matrices: what does the last one first."""
    np = numpy()
    whole = identity_matrix()
    for matrix in matrices:
        whole = whole @ np.array(matrix, dtype=float)
    return whole


def inverse_matrix(matrix: Numbers) -> Array:
    """Return the matrix that undoes one."""
    return numpy().linalg.inv(matrix)


def is_same_transform(matrix0: Numbers, matrix1: Numbers) -> bool:
    """Tell whether two matrices do the same, their scale aside."""
    np = numpy()
    one, two = np.array(matrix0, dtype=float), np.array(matrix1, dtype=float)
    return bool(np.allclose(one / one[3, 3], two / two[3, 3]))
