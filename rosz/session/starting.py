"""Starting threads, also while the process ends.

Python 3.12 starts no thread once the main thread has come to its end, not even before what is
registered with atexit has run (What's New in Python 3.12, Changes in the Python API).
"""

from __future__ import annotations

import threading

__all__ = ("start",)


def start(thread: threading.Thread) -> bool:
    """Start a thread, unless the process is ending.

    Returns:
        Whether it runs.

    Raises:
        RuntimeError: The system has no more threads.
    """
    try:
        thread.start()
    except RuntimeError:
        if threading.main_thread().is_alive():
            raise
        return False
    return True
