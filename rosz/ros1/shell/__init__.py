"""The folder that ``rosz env`` adds to PYTHONPATH, as ROS 1's setup.bash adds rospy's."""

__all__ = ()
