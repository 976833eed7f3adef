"""A bad cable: ``wire.py ONE OTHER DELAY LOSS RATE DUPLICATE REORDER`` carries frames between two
TAP interfaces.

Does what ``tc netem`` does, which many kernels come without. Ends with its standard input.
"""

from __future__ import annotations

import fcntl
import heapq
import itertools
import os
import random
import select
import struct
import sys
import time

_TUNSETIFF = 0x400454CA
_TAP_WITHOUT_HEADER = 0x0002 | 0x1000
_FRAME = 65536
_QUEUED_SECONDS = 1.0
"""What a full queue of a slow link holds; more is dropped, as a switch does."""
_LATE_SECONDS = 0.02
"""By how much a frame that others overtake is late at most."""


def tap(name: str) -> int:
    """Create an interface whose frames this process reads and writes."""
    fd = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(fd, _TUNSETIFF, struct.pack("16sH", name.encode(), _TAP_WITHOUT_HEADER))
    return fd


def main() -> None:
    one, other = tap(sys.argv[1]), tap(sys.argv[2])
    delay, loss, rate, duplicate, reorder = map(float, sys.argv[3:8])
    chance = random.Random(1)
    order = itertools.count()
    waiting: list[tuple[float, int, int, bytes]] = []
    free = {one: 0.0, other: 0.0}  # when the direction to there has sent all it was given
    across = {one: other, other: one}
    sys.stdout.write("up\n")
    sys.stdout.flush()
    while True:
        left = None if not waiting else max(0.0, waiting[0][0] - time.monotonic())
        readable, _, _ = select.select([one, other, 0], [], [], left)
        if 0 in readable:
            return
        now = time.monotonic()
        for fd in readable:
            frame, to = os.read(fd, _FRAME), across[fd]
            if chance.random() < loss or free[to] > now + _QUEUED_SECONDS:
                continue
            free[to] = max(now, free[to]) + (len(frame) / rate if rate else 0.0)
            for _ in range(1 + (chance.random() < duplicate)):
                late = _LATE_SECONDS * chance.random() if chance.random() < reorder else 0.0
                heapq.heappush(waiting, (free[to] + delay + late, next(order), to, frame))
        while waiting and waiting[0][0] <= now:
            _, _, to, frame = heapq.heappop(waiting)
            try:
                os.write(to, frame)
            except OSError:  # its interface is not up yet
                continue


if __name__ == "__main__":
    main()
