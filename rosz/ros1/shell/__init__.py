"""What ``rosz env`` puts on the PYTHONPATH, as ROS 1's setup.bash puts rospy there."""

__all__ = ()
