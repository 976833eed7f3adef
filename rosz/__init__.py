"""rosz: the ROS 1 experience without a master, on Eclipse Zenoh."""
