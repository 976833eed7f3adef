#!/usr/bin/env python3
"""Offer a service that adds two numbers."""

import rosz
from rosz.msgs.rospy_tutorials.srv import AddTwoInts

with rosz.Node("add_two_ints_server") as node:

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        """Return the sum of two numbers; an exception here would be sent to the client."""
        node.log.info("%d + %d", request.a, request.b)
        return AddTwoInts.Response(sum=request.a + request.b)

    node.service("add_two_ints", AddTwoInts, add)
    node.spin()
