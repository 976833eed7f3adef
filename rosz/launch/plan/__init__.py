"""Launch plans: the XML of launch files, its scopes and substitutions. Pure apart from the context.

``plan(files, args, context)`` reads files and arguments into a frozen `Plan`. The public module
`substitution` applies the substitutions alone. May import floor 0 and `rosz.params`.

``rosz help launch`` lists the additions to roslaunch, and the tags and attributes of ROS 2's XML
that work. ``<push_ros_namespace>`` lasts to the end of its group or file, while in ROS 2 it also
affects the file that includes it. ``<arg>`` and ``<param>`` keep ROS 1's rules: an included file
sees only args passed to it, and a ``<param>`` outside a node is a global parameter. For
``<param from="…">`` there is ``<rosparam file="…">``.
"""

from rosz.launch.plan.context import (
    LaunchArguments,
    LaunchContext,
    LaunchText,
    SystemContext,
    parse_arguments,
)
from rosz.launch.plan.document import Document, Element, parse
from rosz.launch.plan.loader import describe_args, plan
from rosz.launch.plan.model import (
    ArgDoc,
    Condition,
    MachinePlan,
    NodePlan,
    Notice,
    ParamPlan,
    Place,
    Plan,
    PlanBuilder,
    SetupPlan,
    StepPlan,
    TestPlan,
    Trigger,
    Wait,
)

__all__ = (
    "ArgDoc",
    "Condition",
    "Document",
    "Element",
    "LaunchArguments",
    "LaunchContext",
    "LaunchText",
    "MachinePlan",
    "NodePlan",
    "Notice",
    "ParamPlan",
    "Place",
    "Plan",
    "PlanBuilder",
    "SetupPlan",
    "StepPlan",
    "SystemContext",
    "TestPlan",
    "Trigger",
    "Wait",
    "describe_args",
    "parse",
    "parse_arguments",
    "plan",
)

PUBLIC_MODULES = ("substitution",)
