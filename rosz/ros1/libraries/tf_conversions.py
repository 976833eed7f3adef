"""tf_conversions: frames of PyKDL from and to transforms and poses (ROS wiki, tf_conversions)."""

# ruff: noqa: N802  # ROS 1's

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

from rosz.msgs.geometry_msgs.msg import Point, Pose, Quaternion
from rosz.ros1.client.tf import transformations
from rosz.ros1.libraries import PyKDL
from rosz.ros1.libraries.PyKDL import *  # noqa: F403
from rosz.ros1.libraries.PyKDL import Frame, Rotation, Vector

__all__: tuple[str, ...] = (
    "fromCameraParams",
    "fromMatrix",
    "fromMsg",
    "fromTf",
    "posemath",
    "toMatrix",
    "toMsg",
    "toTf",
    "transformations",
)
__all__ += PyKDL.__all__

posemath: ModuleType  # built by the importer

numpy = transformations.numpy


def fromTf(tf: tuple[Sequence[float], Sequence[float]]) -> Frame:
    """Return the frame of a translation and a quaternion, as ``lookupTransform`` returns them."""
    position, quaternion = tf
    return Frame(Rotation.Quaternion(*quaternion), Vector(*position))


def toTf(
    f: Frame,
) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    """Return the translation and the quaternion of a frame."""
    return (f.p[0], f.p[1], f.p[2]), f.M.GetQuaternion()


def fromMsg(p: Any) -> Frame:
    """Return the frame of a Pose message."""
    at, q = p.position, p.orientation
    return Frame(Rotation.Quaternion(q.x, q.y, q.z, q.w), Vector(at.x, at.y, at.z))


def toMsg(f: Frame) -> Pose:
    """Return a frame as a Pose message."""
    return Pose(Point(*f.p.numbers), Quaternion(*f.M.GetQuaternion()))


def fromMatrix(m: Any) -> Frame:
    """Return the frame of a 4x4 numpy array."""
    turned = Rotation(*(m[row, column] for row in range(3) for column in range(3)))
    return Frame(turned, Vector(m[0, 3], m[1, 3], m[2, 3]))


def toMatrix(f: Frame) -> Any:
    """Return a frame as a 4x4 numpy array.

    Raises:
        UsageError: numpy is not installed.
    """
    rows = [[f[row, column] for column in range(4)] for row in range(3)]
    return numpy.array([*rows, [0, 0, 0, 1]])


def fromCameraParams(cv: Any, rvec: Any, tvec: Any) -> Frame:
    """Return the frame of a camera.

    Args:
        cv: The module of OpenCV.
        rvec: Rotation vector of three rows, as OpenCV's Rodrigues takes it.
        tvec: Translation vector of three rows.

    Raises:
        UsageError: numpy is not installed.
    """
    m = numpy.zeros((4, 4), dtype=numpy.float32)
    m[3, 3] = 1.0
    for row in range(3):
        m[row, 3] = tvec[row, 0]
    if hasattr(cv, "Rodrigues2"):
        cv.Rodrigues2(rvec, m[:3, :3])
    else:  # newer versions of OpenCV return the matrix
        m[:3, :3] = cv.Rodrigues(rvec)[0]
    return fromMatrix(m)
