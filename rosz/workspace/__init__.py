"""The packages of a workspace: create them, check them, and write files from them.

Python needs no building, so `check` finds the errors that a build would report; catkin builds C++.
May import anything up to ``rosz.ros1``. The names are imported on first use, since commands have
to start fast.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from rosz.workspace.ament import LICENSES, AmentPackage
    from rosz.workspace.catkin import build
    from rosz.workspace.checks import Checked, check, find_packages
    from rosz.workspace.creation import create, write_setup
    from rosz.workspace.editor import editor_folder, write_stubs
    from rosz.workspace.generate import Generator
    from rosz.workspace.migration import Migration, migrate
    from rosz.workspace.problem import Problem
    from rosz.workspace.programs import is_compiled
else:
    __getattr__ = exports_of(__name__)
