"""``python -m rosz.ros1 SCRIPT [ARGUMENTS]``: run a Python script with ROS 1's names importable."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from rosz.errors import RoszError

_USAGE = "usage: python -m rosz.ros1 SCRIPT [ARGUMENTS]\n"


def main(argv: Sequence[str]) -> None:
    """Run the script that the command line names."""
    from rosz.ros1.importer import install
    from rosz.ros1.script import Script

    if not argv or argv[0] in {"-h", "--help"}:
        sys.stderr.write(_USAGE)
        sys.exit(0 if argv else 2)
    try:
        install()
        script = Script(argv[0])
    except RoszError as error:
        sys.stderr.write(f"rosz: {error}\n")
        sys.exit(1)
    script.run(argv[1:])


main(sys.argv[1:])
