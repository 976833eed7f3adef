"""xacro: the program of ROS 1's package, which is PyPI's distribution of the same source.

It asks ament_index_python for ``$(find PACKAGE)``; `rosz.ros2` has that, with the packages of rosz.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rosz.ros1.importer import install

__all__ = ("main",)


def main() -> None:
    """Expand the xacro file of the command line."""
    # A script 'xacro.py' would be imported in place of the module.
    own = Path(sys.argv[0]).resolve().parent
    sys.path[:] = [folder for folder in sys.path if Path(folder or ".").resolve() != own]
    install()
    try:
        import xacro
    except ModuleNotFoundError as error:
        if error.name != "xacro":
            raise
        sys.exit("xacro: it is not installed here; run: pip install 'rosz[xacro]'")
    xacro.main()
