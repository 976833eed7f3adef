"""ROS 1's libraries for nodes: rospy, actions, transforms, dynamic_reconfigure and messages."""
