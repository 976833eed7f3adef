"""``python -m rosz``: the ``rosz`` command."""

from rosz.cli.main import main

if __name__ == "__main__":
    main()
