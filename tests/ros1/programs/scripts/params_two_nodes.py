#!/usr/bin/env python
"""Two nodes that talk through parameters: this one waits for the other's answer."""

import sys

import rospy

role = rospy.myargv()[1]
rospy.init_node(role)
if role == "asker":
    rospy.set_param("/question", {"text": "how many", "of": ["apples", "pears"]})
    print("asked")
    while not rospy.has_param("/answer"):
        rospy.sleep(0.02)
    print("answer", rospy.get_param("/answer"), rospy.has_param("/question"))
else:
    question = rospy.get_param("/question")
    print("question", question["text"], question["of"])
    rospy.delete_param("/question")
    rospy.set_param("/answer", len(question["of"]))
    if rospy.has_param("/answer"):
        print("answered")
    rospy.set_param("/checked", True)
    while rospy.get_param("/answer", None) is not None and not rospy.is_shutdown():
        rospy.sleep(0.02)
    sys.exit(4)
if role == "asker":
    while not rospy.has_param("/checked"):
        rospy.sleep(0.02)
    rospy.delete_param("/checked")
    rospy.delete_param("/answer")
