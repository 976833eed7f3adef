#!/usr/bin/env python3
"""Call a service again and again, with numbers that grow.

Parameters: ~rate (calls per second).
"""

import rosz
from rosz.msgs.rospy_tutorials.srv import AddTwoInts

with rosz.Node("add_two_ints_client") as node:
    add_two_ints = node.client("add_two_ints", AddTwoInts)
    for number in node.rate(node.params.get("~rate", 1.0)):
        # A call without an answer raises WaitTimeout, so that nothing waits forever.
        response = add_two_ints.call(AddTwoInts.Request(a=number, b=number), timeout=5.0)
        node.log.info("%d + %d = %d", number, number, response.sum)
