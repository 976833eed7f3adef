"""rosbag.rosbag_main: the command as a function."""

from rosz.ros1.tool import Tool

__all__ = ("rosbagmain",)

rosbagmain = Tool("rosbag").main
