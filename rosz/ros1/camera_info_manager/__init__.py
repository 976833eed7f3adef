"""camera_info_manager: the calibration of a camera, in a file (ROS wiki, camera_info_manager_py).

It may import floors 0 to 6, and rospy.
"""

from __future__ import annotations

from rosz.ros1.camera_info_manager.camera_info_manager import (
    CameraInfo,
    CameraInfoError,
    CameraInfoManager,
    CameraInfoMissingError,
    SetCameraInfo,
    SetCameraInfoResponse,
    URL_empty,
    URL_file,
    URL_invalid,
    URL_package,
    default_camera_info_url,
    genCameraName,
    getPackageFileName,
    loadCalibrationFile,
    parseURL,
    resolveURL,
    saveCalibration,
    saveCalibrationFile,
)
from rosz.ros1.camera_info_manager.zoom_camera_info_manager import (
    ApproximateZoomCameraInfoManager,
    InterpolatingZoomCameraInfoManager,
    ZoomCameraInfoManager,
)

__all__ = (
    "ApproximateZoomCameraInfoManager",
    "CameraInfo",
    "CameraInfoError",
    "CameraInfoManager",
    "CameraInfoMissingError",
    "InterpolatingZoomCameraInfoManager",
    "SetCameraInfo",
    "SetCameraInfoResponse",
    "URL_empty",
    "URL_file",
    "URL_invalid",
    "URL_package",
    "ZoomCameraInfoManager",
    "default_camera_info_url",
    "genCameraName",
    "getPackageFileName",
    "loadCalibrationFile",
    "parseURL",
    "resolveURL",
    "saveCalibration",
    "saveCalibrationFile",
)
