"""ROS 1's libraries that only some nodes need, such as smach and cv_bridge."""
