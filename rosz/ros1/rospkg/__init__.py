"""rospkg: packages on the package path (rospkg's documentation), from rosz's own index of them.

Stacks and rosdep keys, which catkin's packages do not have, are not there.
"""

from rosz.ros1.rospkg.environment import (
    get_etc_ros_dir,
    get_log_dir,
    get_ros_home,
    get_ros_package_path,
    get_ros_paths,
    get_ros_root,
    get_test_results_dir,
    on_ros_path,
)
from rosz.ros1.rospkg.manifest import (
    MANIFEST_FILE,
    PACKAGE_FILE,
    InvalidManifest,
    Manifest,
    ResourceNotFound,
)
from rosz.ros1.rospkg.rospack import RosPack, RosStack, get_package_name

__all__ = (
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "InvalidManifest",
    "Manifest",
    "ResourceNotFound",
    "RosPack",
    "RosStack",
    "get_etc_ros_dir",
    "get_log_dir",
    "get_package_name",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_paths",
    "get_ros_root",
    "get_test_results_dir",
    "on_ros_path",
)
