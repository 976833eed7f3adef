"""``python -m rosz.idl [--check]``: (re)generate ``rosz.msgs`` from ``interfaces/``."""

from __future__ import annotations

import sys
from pathlib import Path

from rosz.idl.generate import shipped_sources, stale, write


def main(arguments: list[str]) -> int:
    """Write the modules, or with ``--check`` tell which are stale."""
    top = Path(__file__).parents[2]
    target = top / "rosz" / "msgs"
    wrong: list[str] = []
    for package, files in shipped_sources(top / "interfaces").items():
        if arguments == ["--check"]:
            wrong += stale(files, target / package)
        else:
            write(files, target / package)
    for line in wrong:
        sys.stderr.write(line + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
