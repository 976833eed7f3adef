"""The ``rosz`` command, also as ``python -m rosz``."""

# What signal itself is made of: that loads so much first that a Ctrl-C falls into it.
import _signal as signal  # type: ignore[import-not-found]  # not told of, as an implementation's

__all__ = ("main",)


def main() -> None:
    """Run the command line of this process, and exit with its code.

    Until a command says what Ctrl-C is to do, it ends the process as if it were no Python program:
    an exception among imports would show a traceback, or be lost in what Python calls back. Also
    what a script starts in the background, deaf to Ctrl-C by the shell, ends by it, as in ROS 1.
    """
    if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_IGN):
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rosz.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
