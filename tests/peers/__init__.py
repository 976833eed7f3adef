"""Runs the test suites of public ROS 1 packages on real ROS 1 and on rosz, and compares."""
