"""The commands beside ROS 1's."""
