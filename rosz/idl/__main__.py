"""``python -m rosz.idl [--check]``: (re)generate ``rosz.msgs`` from ``interfaces/``."""

from __future__ import annotations

import sys
from pathlib import Path

from rosz.idl.catalog import Catalog
from rosz.idl.generate import Folders, generate, shipped_module, stale, write


def main(arguments: list[str]) -> int:
    """Write the modules, or with ``--check`` tell which are stale."""
    top = Path(__file__).parents[2]
    interfaces, target = top / "interfaces", top / "rosz" / "msgs"
    packages = sorted(file.parent.name for file in interfaces.glob("*/package.xml"))
    folders = Folders(lambda name: interfaces / name if name in packages else None)
    catalog = Catalog(folders.find)
    wrong: list[str] = []
    for package in packages:
        files = generate(package, folders, catalog, shipped_module)
        if arguments == ["--check"]:
            wrong += stale(files, target / package)
        else:
            write(files, target / package)
    for line in wrong:
        sys.stderr.write(line + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
