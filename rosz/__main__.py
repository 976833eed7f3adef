"""The ``rosz`` command, also as ``python -m rosz``."""

# The module signal is a layer over _signal that takes long to import; Ctrl-C could interrupt that.
import _signal as signal  # type: ignore[import-not-found]  # it has no stubs


def main() -> None:
    """Run the command line of this process, and exit with its exit code.

    Until a command sets a handler, Ctrl-C ends the process at once: `KeyboardInterrupt` during an
    import would print a traceback, or get lost in a callback. Ctrl-C also ends a command that a
    script runs in the background, although the shell makes it ignore Ctrl-C; ROS 1's do so too.
    """
    if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_IGN):
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rosz.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
