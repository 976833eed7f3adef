"""ROS 2's Python client library over rosz.

The names become importable together with ROS 1's: see ``rosz.ros1``. May import everything below
the command line, except ``rosz.ros1``.
"""

__all__ = ()
