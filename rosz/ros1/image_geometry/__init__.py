"""image_geometry: camera models (ROS wiki, image_geometry).

Needs the extra ``rosz[vision]``. May import numpy and OpenCV.
"""

from __future__ import annotations

from rosz.ros1.image_geometry.cameramodels import PinholeCameraModel, StereoCameraModel

PUBLIC_MODULES = ("cameramodels",)

__all__ = ("PinholeCameraModel", "StereoCameraModel")
