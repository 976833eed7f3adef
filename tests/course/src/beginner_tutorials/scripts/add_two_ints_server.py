#!/usr/bin/env python
"""Adds two numbers for whoever asks."""

import rospy
from beginner_tutorials.srv import AddTwoInts, AddTwoIntsResponse


def add(request):
    total = request.a + request.b
    print("Returning [%d + %d = %d]" % (request.a, request.b, total))
    return AddTwoIntsResponse(total)


rospy.init_node("add_two_ints_server")
rospy.Service("add_two_ints", AddTwoInts, add)
print("Ready to add two ints.")
rospy.spin()
