"""``python -m rosz``: the ``rosz`` command."""

import sys

if __name__ == "__main__":
    try:
        from rosz.cli.main import main

        main()
    except KeyboardInterrupt:  # so early that the command could not see to it itself
        sys.exit(130)
