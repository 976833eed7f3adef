"""Checks of the packages of a workspace: what a build would have told, where nothing is built.

Each check yields problems with their places; `check` runs all of them over some packages. May
import anything up to ``rosz.ros1``.
"""

from rosz.workspace.check import Checked, check
from rosz.workspace.find import find_packages
from rosz.workspace.problem import Problem
from rosz.workspace.setup import write_setup

__all__ = ("Checked", "Problem", "check", "find_packages", "write_setup")
