"""tf_conversions: what of it needs no PyKDL, the arithmetic of rotations (ROS wiki)."""

from rosz.ros1.tf import transformations

__all__ = ("transformations",)
