#!/usr/bin/env python
"""Has two numbers of the command line added."""

import sys

import rospy
from beginner_tutorials.srv import AddTwoInts

if len(sys.argv) != 3:
    print("%s [x y]" % sys.argv[0].split("/")[-1])
    sys.exit(1)
x, y = int(sys.argv[1]), int(sys.argv[2])
print("Requesting %d+%d" % (x, y))
rospy.wait_for_service("add_two_ints")
try:
    answer = rospy.ServiceProxy("add_two_ints", AddTwoInts)(x, y)
    print("%d + %d = %d" % (x, y, answer.sum))
except rospy.ServiceException as error:
    print("Service did not process request: %s" % error)
