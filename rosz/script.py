"""Run a Python script: ``python -m rosz.script SCRIPT [ARGUMENTS]``, as rosz starts scripts.

It is the same as ``python -m rosz.ros1``, but Ctrl-C ends the process without a traceback until the
script begins: a traceback from an import of rosz would tell the script's author nothing.
``--container`` in place of a script runs several.
"""

import signal
import sys


def main() -> None:
    """Run the script that the command line of this process names."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rosz.ros1.__main__ import main as run

    run(sys.argv[1:], lambda: signal.signal(signal.SIGINT, before))


if __name__ == "__main__":
    main()
