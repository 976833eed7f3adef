"""ROS 1's Python modules over rosz; importing this package makes them importable.

After ``import rosz.ros1`` programs can ``import rospy``, ``from std_msgs.msg import String`` and so
on. The modules are adapters over the packages below, and may import everything below the commands.

``state``, ``exceptions`` and ``modules`` serve the others: the state of the process, rospy's
exceptions, and the table of modules for ``importer``. ``script`` and ``python2`` run scripts. Each
is imported on its own, since start-up needs few of them.
"""

from rosz.ros1.importer import install

PUBLIC_MODULES = ("__main__", "modules", "python2", "python_setup")

__all__ = ("install",)

install()
