"""Replacements for the programs, packages and modules of ROS that rosz does not have.

Shells, ``rosz run``, launch files and imports find here their answer to such a name.
"""

from __future__ import annotations

_NOTHING_TO_BUILD = "nothing needs building; 'rosz pkg check' looks for mistakes"
_NOTHING_TO_INSTALL = "pip installs what a package imports; messages and rospy come with rosz"
_MASTER = "there is no master; nodes find each other, and 'rosz core' is a meeting point"


def _of_ros2(what: str) -> str:
    """Return that a program of ROS 2 works beside rosz."""
    return (
        f"{what} of ROS 2 works beside rosz with RMW_IMPLEMENTATION=rmw_zenoh_cpp: rosz help ros2"
    )


_WINDOWS = "'rosz web' shows graph, plots, log, parameters and more in a browser"
_GAZEBO = "'rosz launch turtlebot3_sim turtlebot3_sim.launch' simulates a TurtleBot3; " + _of_ros2(
    "ros_gz_bridge"
)
_TRANSFORMS = "in a node use tf2_ros: Buffer, TransformListener, StaticTransformBroadcaster"
_LAUNCH = "launch files are XML: 'rosz launch PACKAGE FILE' runs them"

COMMANDS = {
    "catkin": _NOTHING_TO_BUILD,
    "catkin_init_workspace": "a workspace is any folder with 'src' in it; nothing needs building",
    "catkin_make_isolated": _NOTHING_TO_BUILD,
    "colcon": "'pip install rosz[colcon]' brings it; programs in Python run without a build",
    "gazebo": _GAZEBO,
    "gzclient": _GAZEBO,
    "gzserver": _GAZEBO,
    "rosclean": "the size of log files is bounded; remove old ones by hand",
    "rosdep": _NOTHING_TO_INSTALL,
    "rosinstall": "git gets sources; a package below 'src' of the workspace is found as it is",
    "rosmake": _NOTHING_TO_BUILD,
    "rosmaster": _MASTER,
    "rostest": "start the nodes with 'rosz launch' and run the test, which may import rostest",
    "rosversion": "'rosz --version' prints the version of rosz",
    "wstool": "git gets sources; a package below 'src' of the workspace is found as it is",
}
"""Commands that people type; each has a program of this name in ``rosz/cli/absent``."""

_PACKAGES = {
    "amcl": _of_ros2("nav2_amcl"),
    "beginner_tutorials": "it is the package that the tutorials create: rosz pkg create --bare",
    "gazebo_ros": _GAZEBO,
    "gmapping": _of_ros2("slam_toolbox"),
    "image_transport": "publish sensor_msgs/Image, or sensor_msgs/CompressedImage, itself",
    "joint_state_publisher_gui": "publish sensor_msgs/JointState, or use 'rosz topic pub'",
    "move_base": _of_ros2("nav2_bringup"),
    "nodelet": "nodelets of C++ need ROS 1; nodes of Python share a process, too: 'rosz"
    " run --with', and in launch files (rosz help containers)",
    "roscpp": "rosz has no C++ API; " + _of_ros2("rclcpp"),
    "roscpp_tutorials": "'rosz run rosz_tutorials publisher.py' is a talker in Python",
    "rospy_tutorials": "'rosz run rosz_tutorials publisher.py' and subscriber.py talk and listen",
    "slam_gmapping": _of_ros2("slam_toolbox"),
    "turtle_tf": _TRANSFORMS,
    "turtle_tf2": _TRANSFORMS,
    "usb_cam": _of_ros2("usb_cam"),
}

_ALIAS = "after 'eval \"$(rosz env)\"' the shell has it"
_ALIASES = {
    "catkin_create_pkg": "use 'rosz pkg create --bare'",
    "catkin_make": "use 'rosz pkg check'; only C++ needs building (rosz help cpp)",
    **dict.fromkeys(("roscd", "rosed", "rosls", "rospack"), _ALIAS),
    "roswtf": "use 'rosz doctor'",
}

_MANIFEST = "rospkg.RosPack().get_manifest(PACKAGE) reads package.xml and manifest.xml"
_STACKS = "rospkg.RosStack() finds the folders with a stack.xml"
_SYSTEM = "platform.freedesktop_os_release() tells the system"
_MODULES = {
    "camera_info_manager.zoom_camera_info_manager": "make a"
    " camera_info_manager.CameraInfoManager for each zoom, with a calibration file of its own",
    "diagnostic_analysis": "'rosz bag export FILE --topic /diagnostics' writes tables",
    "smclib": "put SMC's statemap.py beside the state machine that SMC generated, or use smach",
    "rosbag.migration": "'rosz bag play' converts messages of older definitions where their fields"
    " fit; rules (.bmr) are for ROS 1's 'rosbag fix'",
    "moveit_commander": "it needs MoveIt, which is C++; " + _of_ros2("moveit_py"),
    "catkin": "rospkg.RosPack().get_path(PACKAGE) is the folder of a package",
    "launch": _LAUNCH,
    "launch_ros": _LAUNCH,
    "xacro": "run: pip install 'rosz[xacro]'",
    "roslib.gentools": "a message class has _md5sum and _full_text",
    "rosunit.xmlrunner": "rosunit.unitrun() writes results as JUnit XML",
    **dict.fromkeys(("rospkg.distro", "rospkg.os_detect"), _SYSTEM),
    **dict.fromkeys(("roslib.manifest", "roslib.manifestlib"), _MANIFEST),
    **dict.fromkeys(("roslib.stack_manifest", "roslib.stacks"), _STACKS),
}


def instead_of(name: str) -> str:
    """Return a replacement for a program, package or module; empty if none is known.

    Args:
        name: Name of the program, package or module.
    """
    for table in COMMANDS, _ALIASES, _PACKAGES, _MODULES:
        if name in table:
            return table[name]
    for prefix, text in (("rqt_", _WINDOWS), ("gazebo_", _GAZEBO)):
        if name.startswith(prefix):
            return text
    return ""
