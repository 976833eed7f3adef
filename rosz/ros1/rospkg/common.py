"""rospkg.common: where older programs find what rospkg raises."""

from rosz.ros1.rospkg.manifest import MANIFEST_FILE, PACKAGE_FILE, ResourceNotFound

__all__ = ("MANIFEST_FILE", "PACKAGE_FILE", "ResourceNotFound")
