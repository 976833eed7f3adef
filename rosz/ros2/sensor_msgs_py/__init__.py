"""sensor_msgs_py: ROS 2's functions for messages of sensors."""

from rosz.ros2.sensor_msgs_py import point_cloud2

__all__ = ("point_cloud2",)
