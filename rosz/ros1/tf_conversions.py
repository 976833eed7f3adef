"""tf_conversions: the part that does not need PyKDL, `transformations` (ROS wiki)."""

from rosz.ros1.tf import transformations

__all__ = ("transformations",)
