"""``python -m rosz.script SCRIPT [ARGUMENTS]``: how rosz starts Python scripts.

The same as ``python -m rosz.ros1``, but that Ctrl-C before the script has begun ends the process as
if it were no Python program: a traceback from among imports of ours would tell its author nothing.
"""

import signal
import sys

__all__ = ("main",)


def main() -> None:
    """Run the script that the command line of this process names."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rosz.ros1.__main__ import main as run

    run(sys.argv[1:], lambda: signal.signal(signal.SIGINT, before))


if __name__ == "__main__":
    main()
