"""image_geometry: camera models of CameraInfo (ROS wiki, image_geometry).

Needs the extra ``rosz[vision]``. Matrices are of type ``numpy.matrix``, as in ROS 1, so that ``*``
multiplies them.
"""

# ruff: noqa: N802, N803, N815  # ROS 1's names, and those of the mathematics

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import Any, TypeAlias

import cv2
import numpy as np

__all__ = ("PinholeCameraModel", "StereoCameraModel")

Matrix: TypeAlias = Any
Pixel: TypeAlias = Any
"""Column and row."""
Point: TypeAlias = Any
"""Coordinates in the frame of the camera: x to the right, y down, z ahead; in metres."""


def mkmat(rows: int, cols: int, L: Any) -> Matrix:
    """Return a matrix of numbers that come row by row."""
    # A view, since numpy warns of the constructor of matrices.
    return np.array(L, np.float64).reshape(rows, cols).view(np.matrix)


def _matrix(name: str, doc: str) -> Callable[[PinholeCameraModel], Matrix]:
    def get(self: PinholeCameraModel) -> Matrix:
        return getattr(self, name)

    get.__doc__ = doc
    return get


def _entry(row: int, column: int, doc: str) -> Callable[[PinholeCameraModel], float]:
    def get(self: PinholeCameraModel) -> float:
        return float(self.P[row, column])

    get.__doc__ = doc
    return get


class PinholeCameraModel:
    """A camera of CameraInfo.

    Attributes:
        K: Intrinsic matrix of the image, after binning and region of interest.
        D: Distortion coefficients, as a column; None if there are none.
        R: Rectification matrix.
        P: Projection matrix of the rectified image, after binning and region of interest.
        full_K: ``K`` of the whole image.
        full_P: ``P`` of the whole image.
        width: Columns of the whole image.
        height: Rows of the whole image.
        binning_x: Pixels of the whole image that make one column; 1 or more.
        binning_y: Pixels of the whole image that make one row; 1 or more.
        raw_roi: Region of interest; the whole image if the message has none.
        tf_frame: Frame of the camera.
        stamp: Time of the message.
    """

    def __init__(self) -> None:
        self.K: Matrix = None
        self.D: Matrix = None
        self.R: Matrix = None
        self.P: Matrix = None
        self.full_K: Matrix = None
        self.full_P: Matrix = None
        self.width: Any = None
        self.height: Any = None
        self.binning_x: Any = None
        self.binning_y: Any = None
        self.raw_roi: Any = None
        self.tf_frame: Any = None
        self.stamp: Any = None

    def fromCameraInfo(self, msg: Any) -> None:
        """Take over a CameraInfo."""
        self.full_K, self.full_P = mkmat(3, 3, msg.K), mkmat(3, 4, msg.P)
        self.K, self.P = self.full_K.copy(), self.full_P.copy()
        self.R = mkmat(3, 3, msg.R)
        self.D = mkmat(len(msg.D), 1, msg.D) if len(msg.D) else None
        self.width, self.height = msg.width, msg.height
        self.resolution = (msg.width, msg.height)
        self.binning_x, self.binning_y = max(1, msg.binning_x), max(1, msg.binning_y)
        self.raw_roi = copy.copy(msg.roi)
        roi = self.raw_roi
        if not (roi.x_offset or roi.y_offset or roi.width or roi.height):
            roi.width, roi.height = self.width, self.height
        self.tf_frame, self.stamp = msg.header.frame_id, msg.header.stamp
        for matrix in self.K, self.P:
            matrix[0, 0] /= self.binning_x
            matrix[1, 1] /= self.binning_y
            matrix[0, 2] = (matrix[0, 2] - roi.x_offset) / self.binning_x
            matrix[1, 2] = (matrix[1, 2] - roi.y_offset) / self.binning_y

    def rectifyImage(self, raw: Any, rectified: Any) -> None:
        """Write the rectified image of a raw one into an array of its size and type."""
        self.mapx, self.mapy = cv2.initUndistortRectifyMap(
            self.K, self.D, self.R, self.P, (self.width, self.height), cv2.CV_32FC1
        )
        cv2.remap(raw, self.mapx, self.mapy, cv2.INTER_CUBIC, rectified)

    def rectifyPoint(self, uv_raw: Pixel) -> Any:
        """Return the pixel of the rectified image that a pixel of the raw one becomes."""
        source = np.array(uv_raw, np.float64).reshape(1, 1, 2)
        return cv2.undistortPoints(source, self.K, self.D, R=self.R, P=self.P)[0, 0]

    def project3dToPixel(self, point: Point) -> tuple[float, float]:
        """Return the rectified pixel of a point; two NaN if the point has none."""
        u, v, w = map(float, np.asarray(self.P) @ [*point[:3], 1.0])
        return (u / w, v / w) if w else (math.nan, math.nan)

    def projectPixelTo3dRay(self, uv: Pixel) -> tuple[float, float, float]:
        """Return the unit vector from the camera through a rectified pixel."""
        x, y = (uv[0] - self.cx()) / self.fx(), (uv[1] - self.cy()) / self.fy()
        length = math.sqrt(x * x + y * y + 1)
        return x / length, y / length, 1 / length

    def getDeltaU(self, deltaX: float, Z: float) -> float:
        """Return columns that a length in metres takes at a depth in metres."""
        return self.fx() * deltaX / Z if Z else math.inf

    def getDeltaV(self, deltaY: float, Z: float) -> float:
        """Return rows that a length in metres takes at a depth in metres."""
        return self.fy() * deltaY / Z if Z else math.inf

    def getDeltaX(self, deltaU: float, Z: float) -> float:
        """Return the metres that columns are at a depth in metres."""
        return Z * deltaU / self.fx()

    def getDeltaY(self, deltaV: float, Z: float) -> float:
        """Return the metres that rows are at a depth in metres."""
        return Z * deltaV / self.fy()

    def fullResolution(self) -> tuple[int, int]:
        """Return width and height of the whole image."""
        return self.resolution

    intrinsicMatrix = _matrix("K", "Return ``K``.")
    distortionCoeffs = _matrix("D", "Return ``D``.")
    rotationMatrix = _matrix("R", "Return ``R``.")
    projectionMatrix = _matrix("P", "Return ``P``.")
    fullIntrinsicMatrix = _matrix("full_K", "Return ``K`` of the whole image.")
    fullProjectionMatrix = _matrix("full_P", "Return ``P`` of the whole image.")
    cx = _entry(0, 2, "Return the column of the principal point, in pixels.")
    cy = _entry(1, 2, "Return the row of the principal point, in pixels.")
    fx = _entry(0, 0, "Return the horizontal focal length, in pixels.")
    fy = _entry(1, 1, "Return the vertical focal length, in pixels.")
    Tx = _entry(
        0, 3, "Return the horizontal translation of the projection, in pixels times metres."
    )
    Ty = _entry(1, 3, "Return the vertical translation of the projection, in pixels times metres.")

    def fovX(self) -> float:
        """Return the horizontal field of view, in radians."""
        return 2 * math.atan(self.width / (2 * self.fx()))

    def fovY(self) -> float:
        """Return the vertical field of view, in radians."""
        return 2 * math.atan(self.height / (2 * self.fy()))

    def tfFrame(self) -> str:
        """Return the frame of the camera."""
        return str(self.tf_frame)


class StereoCameraModel:
    """Two cameras with parallel axes.

    Attributes:
        left: The left camera.
        right: The right camera, whose ``Tx`` holds the distance of both.
        Q: The matrix that makes of column, row, disparity and 1 a point in homogeneous coordinates.
    """

    def __init__(self) -> None:
        self.left = PinholeCameraModel()
        self.right = PinholeCameraModel()

    def fromCameraInfo(self, left_msg: Any, right_msg: Any) -> None:
        """Take over the CameraInfo of each camera."""
        self.left.fromCameraInfo(left_msg)
        self.right.fromCameraInfo(right_msg)
        right = self.right
        self.Q = np.zeros((4, 4))
        self.Q[0, 0] = self.Q[1, 1] = 1.0
        self.Q[:3, 3] = -right.cx(), -right.cy(), right.fx()
        self.Q[3, 2] = -right.fx() / right.Tx()

    def tfFrame(self) -> str:
        """Return the frame of the points, which is that of the left camera."""
        return self.left.tfFrame()

    def project3dToPixel(self, point: Point) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the rectified pixels of a point in the left and the right image."""
        return self.left.project3dToPixel(point), self.right.project3dToPixel(point)

    def projectPixelTo3d(self, left_uv: Pixel, disparity: float) -> tuple[float, float, float]:
        """Return the point of a rectified pixel of the left image and its disparity, in pixels.

        A point at infinity, of no disparity, is given as three zeros.
        """
        x, y, z, w = map(float, self.Q @ [left_uv[0], left_uv[1], disparity, 1.0])
        return (x / w, y / w, z / w) if w else (0.0, 0.0, 0.0)

    def getZ(self, disparity: float) -> float:
        """Return the depth in metres of a disparity in pixels."""
        return -self.right.Tx() / disparity if disparity else math.inf

    def getDisparity(self, Z: float) -> float:
        """Return the disparity in pixels of a depth in metres."""
        return -self.right.Tx() / Z if Z else math.inf
