"""ROS 1's tools as Python modules, such as roslaunch and rosbag."""
