"""The packages of a workspace: create them, and check them.

Nothing is built here, so `check` finds the errors that a build would report. May import anything up
to ``rosz.ros1``.
"""

from rosz.workspace.check import Checked, check, find_packages
from rosz.workspace.create import create, write_setup
from rosz.workspace.problem import Problem

__all__ = (
    "Checked",
    "Problem",
    "check",
    "create",
    "find_packages",
    "write_setup",
)

PUBLIC_MODULES = ("generate",)
