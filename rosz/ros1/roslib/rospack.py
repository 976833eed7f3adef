"""roslib.rospack: asking for packages, as programs of before rospkg do."""

from rosz.ros1.roslib.packages import list_pkgs
from rosz.ros1.rospkg import ResourceNotFound, RosPack

__all__ = ("ResourceNotFound", "RosPack", "list_pkgs")
