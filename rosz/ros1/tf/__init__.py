"""tf: coordinate frames (ROS wiki, tf)."""

from rosz.ros1.tf import transformations

__all__ = ("transformations",)
