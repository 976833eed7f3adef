"""camera_info_manager: the calibration of a camera, in a file (ROS wiki, camera_info_manager_py).

URLs of calibrations begin with ``file:///`` or ``package://``; ``${NAME}`` in them is the name of
the camera, ``${ROS_HOME}`` the folder of ROS.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import yaml

from rosz.msgs.sensor_msgs.msg import CameraInfo
from rosz.msgs.sensor_msgs.srv import SetCameraInfo
from rosz.ros1.client import rospy
from rosz.ros1.tools.rospkg import ResourceNotFound, RosPack

__all__ = (
    "CameraInfo",
    "CameraInfoError",
    "CameraInfoManager",
    "CameraInfoMissingError",
    "SetCameraInfo",
    "SetCameraInfoResponse",
    "URL_empty",
    "URL_file",
    "URL_invalid",
    "URL_package",
    "default_camera_info_url",
    "genCameraName",
    "getPackageFileName",
    "loadCalibrationFile",
    "parseURL",
    "resolveURL",
    "saveCalibration",
    "saveCalibrationFile",
)

SetCameraInfoResponse: Any = SetCameraInfo.Response

URL_empty = 0
URL_file = 1
URL_package = 2
URL_invalid = 3

default_camera_info_url = "file://${ROS_HOME}/camera_info/${NAME}.yaml"

_VARIABLE = re.compile(r"\$\{(\w*)\}?")
_MATRICES = {"camera_matrix": "k", "rectification_matrix": "r", "projection_matrix": "p"}


class CameraInfoError(Exception):
    """Base class of the errors of this module."""


class CameraInfoMissingError(CameraInfoError):
    """The calibration has not been loaded, or its package does not exist."""


class CameraInfoManager:
    """The calibration of a camera, with the service ``set_camera_info`` that replaces it.

    Args:
        cname: Name of the camera.
        url: URL of the calibration; `default_camera_info_url` when empty.
        namespace: Namespace of the service.
    """

    def __init__(self, cname: str = "camera", url: str = "", namespace: str = "") -> None:
        self.cname = cname
        self.url = url
        self.camera_info: Any = None
        name = f"{namespace}/set_camera_info" if namespace else "set_camera_info"
        self.svc = rospy.Service(name, SetCameraInfo, self.setCameraInfo)

    def __str__(self) -> str:
        return f"[{self.cname}]{self.url}"

    def getCameraInfo(self) -> Any:  # noqa: N802  # ROS 1's
        """Return the calibration.

        Raises:
            CameraInfoMissingError: It has not been loaded since the name or the URL changed.
        """
        if self.camera_info is None:
            raise CameraInfoMissingError("Calibration missing, loadCameraInfo() needed.")
        return self.camera_info

    def getCameraName(self) -> str:  # noqa: N802
        """Return the name of the camera."""
        return self.cname

    def getURL(self) -> str:  # noqa: N802
        """Return the URL, with its variables."""
        return self.url

    def isCalibrated(self) -> bool:  # noqa: N802
        """Return whether the calibration is not empty; see `getCameraInfo`."""
        return bool(self.getCameraInfo().k[0] != 0.0)

    def loadCameraInfo(self) -> None:  # noqa: N802
        """Load the calibration from its file. Without a file the calibration is empty.

        Raises:
            CameraInfoMissingError: The package of the URL does not exist.
            OSError: The file cannot be read.
        """
        self.camera_info = load_url(self.url or default_camera_info_url, self.cname)

    def setCameraInfo(self, req: Any) -> Any:  # noqa: N802
        """Take and store the calibration of a request, and return the response."""
        self.camera_info = req.camera_info
        if saveCalibration(req.camera_info, self.url, self.cname):
            return SetCameraInfoResponse(success=True)
        return SetCameraInfoResponse(status_message="Error storing camera calibration.")

    def setCameraName(self, cname: str) -> bool:  # noqa: N802
        """Set the name of the camera; return whether it is letters, digits and ``_``."""
        if not cname or genCameraName(cname) != cname:
            return False
        if self.cname != cname:
            self.cname, self.camera_info = cname, None
        return True

    def setURL(self, url: str) -> bool:  # noqa: N802
        """Set the URL of the calibration; return whether it is valid."""
        if parseURL(resolveURL(url, self.cname)) == URL_invalid:
            return False
        if self.url != url:
            self.url, self.camera_info = url, None
        return True


def load_url(url: str, cname: str) -> Any:
    """Return the calibration at a URL; see `CameraInfoManager.loadCameraInfo`."""
    resolved = resolveURL(url, cname)
    kind = parseURL(resolved)
    rospy.loginfo(f"camera calibration URL: {resolved}")
    if kind == URL_file:
        return loadCalibrationFile(resolved[7:], cname)
    if kind == URL_package:
        filename = getPackageFileName(resolved)
        if not filename:
            raise CameraInfoMissingError("Calibration package missing.")
        return loadCalibrationFile(filename, cname)
    rospy.logerr(f"Invalid camera calibration URL: {resolved}")
    return CameraInfo()


def genCameraName(from_string: str) -> str:  # noqa: N802
    """Return a name for a camera, made of a text."""
    kept = (
        character if character.isalnum() or character == "_" else "_" for character in from_string
    )
    return "".join(kept) or "_"


def getPackageFileName(url: str) -> str:  # noqa: N802
    """Return the path of a file in a package; empty if there is no such package."""
    package, slash, rest = url[len("package://") :].partition("/")
    try:
        return RosPack().get_path(package) + slash + rest
    except ResourceNotFound:
        rospy.logwarn(f"unknown package: {package} (ignored)")
        return ""


def parseURL(url: str) -> int:  # noqa: N802
    """Return the kind of a URL: `URL_empty`, `URL_file`, `URL_package` or `URL_invalid`."""
    if not url:
        return URL_empty
    if url.upper().startswith("FILE:///"):
        return URL_file
    if re.fullmatch("package://[^/]+/.+", url, re.IGNORECASE) or re.fullmatch(
        "package:///.+", url, re.IGNORECASE
    ):
        return URL_package
    return URL_invalid


def resolveURL(url: str, cname: str) -> str:  # noqa: N802
    """Return a URL with its variables replaced; others stay, with a warning.

    Args:
        url: The URL.
        cname: Name of the camera.
    """
    home = os.environ.get("HOME")
    folder = os.environ.get("ROS_HOME") or (f"{home}/.ros" if home else None)

    def value(match: re.Match[str]) -> str:
        replacement = {"${NAME}": cname, "${ROS_HOME}": folder}.get(match[0])
        if replacement is None:
            rospy.logwarn(f"[CameraInfoManager] invalid URL substitution (not resolved): {url}")
        return match[0] if replacement is None else replacement

    return _VARIABLE.sub(value, url)


def loadCalibrationFile(filename: str, cname: str) -> Any:  # noqa: N802
    """Return the calibration in a file. It is empty if the file is missing or empty.

    Args:
        filename: Path of the file.
        cname: Name of the camera; another one in the file gives a warning.

    Raises:
        CameraInfoError: The file is not a calibration.
        OSError: The file cannot be read.
    """
    made: Any = CameraInfo()
    try:
        fields = yaml.safe_load(Path(filename).read_text("utf-8"))
    except FileNotFoundError:
        return made
    except yaml.YAMLError as error:
        raise CameraInfoError(f"[{filename}] is not a calibration: {error}") from error
    if fields is None:
        return made
    try:
        if fields["camera_name"] != cname:
            rospy.logwarn(
                f"[{cname}] does not match name {fields['camera_name']} in file {filename}"
            )
        made.width, made.height = fields["image_width"], fields["image_height"]
        made.distortion_model = fields["distortion_model"]
        made.d = fields["distortion_coefficients"]["data"]
        for key, field in _MATRICES.items():
            setattr(made, field, fields[key]["data"])
    except (KeyError, TypeError) as error:
        raise CameraInfoError(f"[{filename}] is not a calibration: no {error}") from error
    return made


def saveCalibration(new_info: Any, url: str, cname: str) -> bool:  # noqa: N802
    """Store a calibration, and return whether that was possible.

    Args:
        new_info: The calibration.
        url: URL of the file; `default_camera_info_url` when empty, or not valid.
        cname: Name of the camera.
    """
    resolved = resolveURL(url or default_camera_info_url, cname)
    rospy.loginfo(f"writing calibration data to URL: {resolved}")
    kind = parseURL(resolved)
    filename = resolved[7:] if kind == URL_file else ""
    if kind == URL_package:
        filename = getPackageFileName(resolved)
    if not filename:
        rospy.logerr(f"Invalid camera calibration URL: {resolved}")
        filename = resolveURL(default_camera_info_url, cname)[7:]
    return saveCalibrationFile(new_info, filename, cname)


def saveCalibrationFile(ci: Any, filename: str, cname: str) -> bool:  # noqa: N802
    """Write a calibration to a file, whose folder is created; see `saveCalibration`."""
    text = yaml.safe_dump(
        {
            "image_width": ci.width,
            "image_height": ci.height,
            "camera_name": cname,
            "distortion_model": ci.distortion_model,
            "distortion_coefficients": {"data": list(ci.d), "rows": 1, "cols": len(ci.d)},
            "camera_matrix": {"data": list(ci.k), "rows": 3, "cols": 3},
            "rectification_matrix": {"data": list(ci.r), "rows": 3, "cols": 3},
            "projection_matrix": {"data": list(ci.p), "rows": 3, "cols": 4},
        }
    )
    path = Path(filename)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    except OSError as error:
        rospy.logerr(f"file [{filename}] not accessible: {error.strerror}")
        return False
    return True
