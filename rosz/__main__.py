"""The ``rosz`` command, also as ``python -m rosz``."""

import signal

__all__ = ("main",)


def main() -> None:
    """Run the command line of this process, and exit with its code.

    Until a command says what Ctrl-C is to do, it ends the process as if it were no Python program:
    an exception among imports would show a traceback, or be lost in what Python calls back.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rosz.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
