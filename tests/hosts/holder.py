"""Keeps namespaces up for as long as somebody holds its standard input; reaps what is orphaned.

As the first process of its namespace it takes everything there with it when it ends.
"""

from __future__ import annotations

import signal
import sys


def main() -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGCHLD):
        signal.signal(number, signal.SIG_IGN)
    sys.stdout.write("up\n")
    sys.stdout.flush()
    sys.stdin.read()


if __name__ == "__main__":
    main()
