#!/usr/bin/env python3
"""Sends the robot from place to place: the client of actionlib that ROS 1's tutorials write."""

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

PLACES = [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0)]
FAR_AWAY = (50.0, 0.0)
LONG = rospy.Duration(600)


def goal_to(place, frame="odom"):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = frame
    goal.target_pose.header.stamp = rospy.Time.now()
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = place
    goal.target_pose.pose.orientation.w = 1.0
    return goal


def show(state):
    rospy.loginfo(GoalStatus.to_string(state))


def main():
    rospy.init_node("waypoint_client")
    client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
    client.wait_for_server()
    for place in PLACES:
        last = []
        client.send_goal(goal_to(place), feedback_cb=last.append)
        state = client.get_state() if client.wait_for_result(LONG) else "too late"
        position = last[-1].base_position.pose.position
        near = abs(position.x - place[0]) < 0.3 and abs(position.y - place[1]) < 0.3
        rospy.loginfo(f"{place}: {GoalStatus.to_string(state)}, near it: {near}")
    client.send_goal(goal_to(FAR_AWAY))
    rospy.loginfo(f"far away in 2 s: {client.wait_for_result(rospy.Duration(2))}")
    client.cancel_goal()
    client.wait_for_result()
    show(client.get_state())
    show(client.send_goal_and_wait(goal_to(PLACES[0], "moon"), LONG))


if __name__ == "__main__":
    main()
