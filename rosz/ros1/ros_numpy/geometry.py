"""ros_numpy.geometry: vectors, points and quaternions as arrays, poses as 4x4 matrices.

Arrays of more dimensions give arrays of messages.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rosz.msgs.geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
from rosz.ros1.ros_numpy.registry import converts_from_numpy, converts_to_numpy
from rosz.ros1.tf import transformations

__all__ = (
    "numpy_to_point",
    "numpy_to_pose",
    "numpy_to_quat",
    "numpy_to_transform",
    "numpy_to_vector3",
    "point_to_numpy",
    "pose_to_numpy",
    "quat_to_numpy",
    "transform_to_numpy",
    "vector3_to_numpy",
)

_HOMOGENEOUS = 4


@converts_to_numpy(Vector3)
def vector3_to_numpy(msg: Vector3, hom: bool = False) -> Any:
    """Return ``[x, y, z]``, and a 0 after it if ``hom``."""
    return np.array([msg.x, msg.y, msg.z, 0] if hom else [msg.x, msg.y, msg.z])


@converts_from_numpy(Vector3)
def numpy_to_vector3(arr: Any) -> Any:
    """Return the vector of ``[x, y, z]`` or ``[x, y, z, 0]``.

    Raises:
        AssertionError: The fourth number is not 0.
    """
    if arr.shape[-1] == _HOMOGENEOUS:
        if np.any(arr[..., -1]):
            raise AssertionError("expected 0 as the fourth number of a vector; a point has 1 there")
        arr = arr[..., :-1]
    return _each(lambda one: Vector3(*one.tolist()), arr, 1)


@converts_to_numpy(Point)
def point_to_numpy(msg: Point, hom: bool = False) -> Any:
    """Return ``[x, y, z]``, and a 1 after it if ``hom``."""
    return np.array([msg.x, msg.y, msg.z, 1] if hom else [msg.x, msg.y, msg.z])


@converts_from_numpy(Point)
def numpy_to_point(arr: Any) -> Any:
    """Return the point of ``[x, y, z]``, or of ``[x, y, z, w]`` divided by ``w``."""
    if arr.shape[-1] == _HOMOGENEOUS:
        arr = arr[..., :-1] / arr[..., -1:]
    return _each(lambda one: Point(*one.tolist()), arr, 1)


@converts_to_numpy(Quaternion)
def quat_to_numpy(msg: Quaternion) -> Any:
    """Return ``[x, y, z, w]``."""
    return np.array([msg.x, msg.y, msg.z, msg.w])


@converts_from_numpy(Quaternion)
def numpy_to_quat(arr: Any) -> Any:
    """Return the quaternion of ``[x, y, z, w]``.

    Raises:
        AssertionError: The array has another shape.
    """
    _check(arr, (4,))
    return _each(lambda one: Quaternion(*one.tolist()), arr, 1)


@converts_to_numpy(Transform)
def transform_to_numpy(msg: Transform) -> Any:
    """Return the 4x4 matrix of a transform."""
    return _matrix(msg.translation, msg.rotation)


@converts_from_numpy(Transform)
def numpy_to_transform(arr: Any) -> Any:
    """Return the transform of a 4x4 matrix.

    Raises:
        AssertionError: The array has another shape.
    """
    _check(arr, (4, 4))
    return _each(lambda one: Transform(_translation(Vector3, one), _rotation(one)), arr, 2)


@converts_to_numpy(Pose)
def pose_to_numpy(msg: Pose) -> Any:
    """Return the 4x4 matrix of a pose."""
    return _matrix(msg.position, msg.orientation)


@converts_from_numpy(Pose)
def numpy_to_pose(arr: Any) -> Any:
    """Return the pose of a 4x4 matrix.

    Raises:
        AssertionError: The array has another shape.
    """
    _check(arr, (4, 4))
    return _each(lambda one: Pose(_translation(Point, one), _rotation(one)), arr, 2)


def _matrix(position: Any, orientation: Any) -> Any:
    matrix = transformations.quaternion_matrix(quat_to_numpy(orientation))
    matrix[:3, 3] = position.x, position.y, position.z
    return matrix


def _translation(kind: Callable[..., Any], matrix: Any) -> Any:
    return kind(*matrix[:3, 3].tolist())


def _rotation(matrix: Any) -> Quaternion:
    return Quaternion(*map(float, transformations.quaternion_from_matrix(matrix)))


def _check(array: Any, shape: tuple[int, ...]) -> None:
    if array.shape[-len(shape) :] != shape:
        raise AssertionError(f"expected an array of shape {shape}, got {array.shape}")


def _each(make: Callable[[Any], Any], array: Any, dimensions: int) -> Any:
    """Return the message of an array, or an array of the messages of its parts."""
    if array.ndim == dimensions:
        return make(array)
    made = np.empty(array.shape[:-dimensions], object)
    for at in np.ndindex(made.shape):
        made[at] = make(array[at])
    return made
