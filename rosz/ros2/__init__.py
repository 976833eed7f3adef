"""ROS 2's Python client library and its companions over rosz.

The names become importable together with ROS 1's: see ``rosz.ros1``. May import everything below
the command line, except ``rosz.ros1``. `PUBLIC_MODULES` are imported by the command ``ros2``.
"""

PUBLIC_MODULES = ("rosidl_runtime_py",)

__all__ = ()
