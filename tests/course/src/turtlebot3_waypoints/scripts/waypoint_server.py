#!/usr/bin/env python3
"""Drives to the place of each goal: an action server of ROS 2 with the node of waypoints.py."""

import math
import threading

import rclpy
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.action import MoveBase
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node

NEAR = 0.1
AHEAD = 0.3
GAIN = 0.3  # commands may take a second of simulated time to arrive


class WaypointServer(Node):
    """Goes where goals say, as long as nobody cancels them."""

    def __init__(self):
        super().__init__("waypoint_server")
        group = ReentrantCallbackGroup()
        self.pose = None
        self.located_once = threading.Event()
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Odometry, "/odom", self.located, 10, callback_group=group)
        self.server = ActionServer(
            self,
            MoveBase,
            "move_base",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group,
        )
        self.get_logger().info("waiting for goals")

    def located(self, message):
        self.pose = message.pose.pose
        self.located_once.set()

    def decide(self, goal):
        known = goal.target_pose.header.frame_id == "odom"
        return GoalResponse.ACCEPT if known else GoalResponse.REJECT

    def execute(self, goal):
        self.located_once.wait()
        began = self.get_clock().now()
        rate = self.create_rate(10)
        target = goal.request.target_pose.pose.position
        while rclpy.ok():
            if goal.is_cancel_requested:
                self.commands.publish(Twist())
                goal.canceled()
                return MoveBase.Result()
            here, q = self.pose.position, self.pose.orientation
            away = target.x - here.x, target.y - here.y
            heading = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y**2 + q.z**2))
            turn = math.remainder(math.atan2(away[1], away[0]) - heading, math.tau)
            feedback = MoveBase.Feedback(base_position=PoseStamped(pose=self.pose))
            feedback.base_position.header.frame_id = "odom"
            goal.publish_feedback(feedback)
            if math.hypot(*away) < NEAR:
                self.commands.publish(Twist())
                seconds = (self.get_clock().now() - began).nanoseconds / 1e9
                self.get_logger().info(f"took simulated time: {seconds > 1.0}")
                goal.succeed()
                return MoveBase.Result()
            command = Twist()
            if abs(turn) < AHEAD:
                command.linear.x = min(0.2, GAIN * math.hypot(*away))
            command.angular.z = GAIN * turn
            self.commands.publish(command)
            rate.sleep()
        return MoveBase.Result()


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(WaypointServer())
    executor.spin()


if __name__ == "__main__":
    main()
