#!/usr/bin/env python3
"""Count, and publish where the count stands.

Parameters: ~start, ~rate (per second), ~step, which may change while it runs.
"""

from rosz_tutorials.msg import Num

import rosz

with rosz.Node("publisher") as node:
    numbers = node.publisher("numbers", Num, queue_size=10)
    count = node.params.get("~start", 0)
    for _ in node.rate(node.params.get("~rate", 1.0)):
        numbers.publish(Num(num=count))
        # Reads are local, so asking every time costs nothing.
        count += node.params.get("~step", 1)
