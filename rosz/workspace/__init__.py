"""The packages of a workspace: create them, and check them.

Nothing is built here, so `check` finds the errors that a build would report. May import anything up
to ``rosz.ros1``.
"""

from rosz.workspace.check import Checked, check, find_packages
from rosz.workspace.create import create, write_setup
from rosz.workspace.migrate import Migration, Program, migrate
from rosz.workspace.problem import Problem

__all__ = (
    "Checked",
    "Migration",
    "Problem",
    "Program",
    "check",
    "create",
    "find_packages",
    "migrate",
    "write_setup",
)

PUBLIC_MODULES = ("editor", "generate")
