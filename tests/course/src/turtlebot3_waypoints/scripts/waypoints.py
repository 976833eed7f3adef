#!/usr/bin/env python3
"""Drives to one place after the other: turn until it lies ahead, then straight on to it."""

import math

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

PLACES = [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0)]
NEAR = 0.05
AHEAD = 0.1


def heading_of(quaternion):
    """Return the rotation about the vertical axis."""
    x, y, z, w = quaternion.x, quaternion.y, quaternion.z, quaternion.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def turn_between(goal, heading):
    """Return the shorter turn from one direction to another."""
    return math.atan2(math.sin(goal - heading), math.cos(goal - heading))


class Waypoints(Node):
    """Looks where the robot is on /odom, and says where to go on /cmd_vel."""

    def __init__(self):
        super().__init__("waypoints")
        self.pose = None
        self.left = list(PLACES)
        self.turning = True
        profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Odometry, "/odom", self.located, profile)
        self.timer = self.create_timer(0.1, self.drive)

    def located(self, message):
        position = message.pose.pose.position
        self.pose = position.x, position.y, heading_of(message.pose.pose.orientation)

    def drive(self):
        if self.pose is None:
            return
        x, y, heading = self.pose
        goal_x, goal_y = self.left[0]
        distance = math.hypot(goal_x - x, goal_y - y)
        turn = turn_between(math.atan2(goal_y - y, goal_x - x), heading)
        command = Twist()
        if distance < NEAR:
            self.get_logger().info(f"reached ({goal_x}, {goal_y})")
            self.left.pop(0)
            self.turning = True
        elif self.turning and abs(turn) > AHEAD:
            command.angular.z = math.copysign(min(1.0, abs(turn) + 0.1), turn)
        else:
            self.turning = False
            command.linear.x = min(0.2, distance + 0.05)
            command.angular.z = turn  # nothing drives perfectly straight
        self.commands.publish(command)
        if not self.left:
            raise SystemExit


def main():
    rclpy.init()
    node = Waypoints()
    try:
        rclpy.spin(node)
    except SystemExit:
        node.get_logger().info("all places reached")
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
