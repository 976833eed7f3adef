"""Call functions of a module under the system's interpreter, as `oracle.Worker` asks.

Each request is a pickled function name, arguments and options on stdin; each reply a pickled pair
of whether the call failed, and its result or traceback, on stdout. Both come behind their length.
"""

# mypy: ignore-errors
from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import struct
import sys
import traceback


def main() -> None:
    requests, replies = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    with contextlib.redirect_stdout(sys.stderr):
        module = importlib.import_module(sys.argv[1])
        while head := requests.read(4):
            function, args, options = pickle.loads(requests.read(*struct.unpack("<I", head)))
            try:
                reply = (False, getattr(module, function)(*args, **options))
            except Exception:  # noqa: BLE001  # the test fails with it
                reply = (True, traceback.format_exc())
            body = pickle.dumps(reply, protocol=4)
            replies.write(struct.pack("<I", len(body)) + body)
            replies.flush()


if __name__ == "__main__":
    main()
