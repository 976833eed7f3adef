"""camera_info_manager: calibrations of cameras with zoom."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from math import radians, tan
from typing import Any, Self

from rosz.ros1.camera_info_manager.camera_info_manager import (
    CameraInfoError,
    CameraInfoManager,
    URL_empty,
    load_url,
    parseURL,
    resolveURL,
)

__all__ = (
    "ApproximateZoomCameraInfoManager",
    "InterpolatingZoomCameraInfoManager",
    "ZoomCameraInfoManager",
)

_FEWEST = 2


class ZoomCameraInfoManager(CameraInfoManager):
    """Base class of the managers of cameras with zoom.

    Args:
        min_zoom: Least zoom.
        max_zoom: Largest zoom.
        cname: Name of the camera.
        url: URL of the calibration.
        namespace: Namespace of the service.
    """

    def __init__(
        self,
        min_zoom: float,
        max_zoom: float,
        cname: str = "camera",
        url: str = "",
        namespace: str = "",
    ) -> None:
        super().__init__(cname, url, namespace)
        self._min_zoom = min_zoom
        self._max_zoom = max_zoom
        self._zoom = min_zoom

    def _update_camera_info(self) -> None:
        raise NotImplementedError

    def set_zoom(self, zoom: float) -> None:
        """Set the zoom, and with it the calibration.

        Raises:
            CameraInfoError: The zoom is out of its range.
        """
        if not self._min_zoom <= zoom <= self._max_zoom:
            raise CameraInfoError("Zoom got outside the allowed range")
        self._zoom = zoom
        self._update_camera_info()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.svc.shutdown()


class ApproximateZoomCameraInfoManager(ZoomCameraInfoManager):
    """Computes the camera matrix from the field of view.

    Args:
        min_fov: Least horizontal field of view, at the largest zoom, in degrees.
        max_fov: Largest horizontal field of view, at the least zoom, in degrees.
        initial_image_width: Width of images in pixels.
        initial_image_height: Height of images in pixels.
        min_zoom: Least zoom.
        max_zoom: Largest zoom.
        cname: Name of the camera.
        url: URL of the calibration.
        namespace: Namespace of the service.
    """

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        min_fov: float,
        max_fov: float,
        initial_image_width: int,
        initial_image_height: int,
        min_zoom: float,
        max_zoom: float,
        cname: str = "camera",
        url: str = "",
        namespace: str = "",
    ) -> None:
        super().__init__(min_zoom, max_zoom, cname, url, namespace)
        self._min_fov = min_fov
        self._max_fov = max_fov
        self._image_width = initial_image_width
        self._image_height = initial_image_height
        self._loaded_camera_info: Any = None

    def loadCameraInfo(self) -> None:  # noqa: N802  # ROS 1's
        """Load the calibration that the others are computed from."""
        super().loadCameraInfo()
        self._loaded_camera_info = deepcopy(self.camera_info)

    def set_resolution(self, width: int, height: int) -> None:
        """Set the size of images in pixels."""
        self._image_width = width
        self._image_height = height
        self._update_camera_info()

    def _update_camera_info(self) -> None:
        loaded = self._loaded_camera_info
        if loaded is None:
            return
        width, height = self._image_width, self._image_height
        share = (self._zoom - self._min_zoom) / (self._max_zoom - self._min_zoom)
        across = radians((self._max_fov - self._min_fov) * (1 - share) + self._min_fov)
        k = list(loaded.k)
        k[0] = width / (2 * tan(across / 2))
        k[4] = height / (2 * tan(across * height / width / 2))
        known = k[2] != 0.0
        k[2] = width / loaded.width * k[2] if known else width / 2.0
        k[5] = height / loaded.height * k[5] if known else height / 2.0
        k[8] = 1.0
        info = deepcopy(loaded)
        info.k, info.width, info.height = k, width, height
        self.camera_info = info


class InterpolatingZoomCameraInfoManager(ZoomCameraInfoManager):
    """Interpolates between calibrations at several zooms.

    Args:
        calibration_url_template: URL of the calibrations, with ``%d`` for the zoom.
        zoom_levels: Zooms that have a calibration.
        cname: Name of the camera.
        url: URL of the calibration at the least zoom.
        namespace: Namespace of the service.
    """

    def __init__(
        self,
        calibration_url_template: str,
        zoom_levels: Sequence[int],
        cname: str = "camera",
        url: str = "",
        namespace: str = "",
    ) -> None:
        super().__init__(min(zoom_levels), max(zoom_levels), cname, url, namespace)
        self._calibration_url_template = calibration_url_template
        self._zoom_levels = list(zoom_levels)
        self._camera_infos: dict[float, Any] = {}

    def loadCameraInfo(self) -> None:  # noqa: N802  # ROS 1's
        """Load the calibrations at all zooms.

        Raises:
            CameraInfoError: There are fewer than two, or they have no URL.
        """
        super().loadCameraInfo()
        self._camera_infos = {}
        for level in self._zoom_levels:
            url = self._calibration_url_template % level
            if parseURL(resolveURL(url, self.cname)) == URL_empty:
                raise CameraInfoError("Zoom camera cannot use default calibration URLs.")
            self._camera_infos[level] = load_url(url, self.cname)
        if len(self._camera_infos) < _FEWEST:
            raise CameraInfoError(
                "Interpolating zoom camera info manager needs at least two calibrations to exist."
            )

    def _update_camera_info(self) -> None:
        if not self.isCalibrated() or not self._camera_infos:
            return
        known = self._camera_infos.get(self._zoom)
        if known is not None:
            self.camera_info = deepcopy(known)
            return
        above = min(level for level in self._zoom_levels if level >= self._zoom)
        below = max(level for level in self._zoom_levels if level <= self._zoom)
        low, high = self._camera_infos[below], self._camera_infos[above]
        share = (self._zoom - below) / (above - below)
        info = deepcopy(low)
        for field in ("k", "p", "r", "d"):
            pairs = zip(getattr(low, field), getattr(high, field), strict=True)
            # The weights are those of camera_info_manager_py, whose drivers depend on them.
            setattr(info, field, [share * a + (1 - share) * b for a, b in pairs])
        self.camera_info = info
