"""roswtf: what its plugins use; ``rosz doctor`` finds problems here.

Plugins of roswtf are not run: nobody looks for them. It may import floors 0 to 6.
"""

from __future__ import annotations

from rosz.ros1.roswtf.context import WtfContext, WtfException
from rosz.ros1.roswtf.model import WtfError, WtfWarning
from rosz.ros1.roswtf.rules import error_rule, warning_rule
from rosz.ros1.tool import Tool

__all__ = (
    "WtfContext",
    "WtfError",
    "WtfException",
    "WtfWarning",
    "error_rule",
    "roswtf_main",
    "warning_rule",
)

roswtf_main = Tool("roswtf").main
