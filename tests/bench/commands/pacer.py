"""Publish at a rate, as evenly as a program can, and tell each second how many went out."""

from __future__ import annotations

import sys
import time

import rosz
from rosz.msgs.std_msgs.msg import Int32


def main() -> None:
    """Publish until killed."""
    rate = float(sys.argv[1])
    with rosz.Node("pacer") as node:
        numbers = node.publisher("/paced", Int32, queue_size=1000)
        message = Int32(1)
        begun = told = time.perf_counter()
        sent = told_sent = 0
        while True:
            now = time.perf_counter()
            due = int((now - begun) * rate)
            while sent < due:  # what is late goes out together: the rate holds
                numbers.publish(message)
                sent += 1
            if now - told >= 1:
                sys.stdout.write(f"{(sent - told_sent) / (now - told)}\n")
                sys.stdout.flush()
                told, told_sent = now, sent
            left = begun + (sent + 1) / rate - time.perf_counter()
            if left > 0:
                time.sleep(left)


if __name__ == "__main__":
    main()
