"""tf_conversions: frames of PyKDL from and to transforms and poses (ROS wiki, tf_conversions)."""

from rosz.ros1.PyKDL import (
    Equal,
    Frame,
    Rotation,
    SetToZero,
    Twist,
    Vector,
    Wrench,
    addDelta,
    diff,
    dot,
)
from rosz.ros1.tf import transformations
from rosz.ros1.tf_conversions import posemath
from rosz.ros1.tf_conversions.posemath import (
    fromCameraParams,
    fromMatrix,
    fromMsg,
    fromTf,
    toMatrix,
    toMsg,
    toTf,
)

__all__ = (
    "Equal",
    "Frame",
    "Rotation",
    "SetToZero",
    "Twist",
    "Vector",
    "Wrench",
    "addDelta",
    "diff",
    "dot",
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
