"""Launch files to plans: XML, scopes, substitutions. Pure but for what a context provides.

``plan(files, args, context)`` settles files and arguments into a frozen `Plan`; `report` answers
the questions that need nothing more than one. May import floor 0, `rosz.params.yaml`.
"""

from rosz.launch.plan.context import LaunchContext, LaunchText, SystemContext
from rosz.launch.plan.model import (
    ArgDoc,
    Condition,
    MachinePlan,
    NodePlan,
    Notice,
    ParamPlan,
    Place,
    Plan,
    SetupPlan,
    TestPlan,
    Wait,
)

__all__ = (
    "ArgDoc",
    "Condition",
    "LaunchContext",
    "LaunchText",
    "MachinePlan",
    "NodePlan",
    "Notice",
    "ParamPlan",
    "Place",
    "Plan",
    "SetupPlan",
    "SystemContext",
    "TestPlan",
    "Wait",
)
