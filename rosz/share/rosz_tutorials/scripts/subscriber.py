#!/usr/bin/env python3
"""Log every number that arrives, after the words that the parameter ~greeting gives."""

from rosz_tutorials.msg import Num

import rosz

with rosz.Node("subscriber") as node:

    def on_number(message: Num) -> None:
        """Log one number."""
        node.log.info("%s %d", node.params.get("~greeting", "I heard"), message.num)

    node.subscription("numbers", Num, on_number)
    node.spin()
