"""cv_bridge: images of ROS as arrays that OpenCV takes, and back (ROS wiki, cv_bridge).

Needs the extra ``rosz[vision]``. May import message classes, numpy and OpenCV.
"""

from __future__ import annotations

from rosz.ros1.cv_bridge.boost.cv_bridge_boost import cvtColorForDisplay, getCvType
from rosz.ros1.cv_bridge.core import CvBridge, CvBridgeError

PUBLIC_MODULES = ("boost", "core", "encodings")

__all__ = ("CvBridge", "CvBridgeError", "cvtColorForDisplay", "getCvType")
