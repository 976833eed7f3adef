"""Launch plans: the XML of launch files, its scopes and substitutions. Pure apart from the context.

``plan(files, args, context)`` reads files and arguments into a frozen `Plan`. The public module
`report` returns what roslaunch prints about one. May import floor 0 and `rosz.params`.

Additions to roslaunch: ``wait_for``, ``wait_timeout``, ``spawn_delay``, ``respawn_max`` (see
`rosz.launch.plan.node`), and from ROS 2's XML:

- ``exec`` for ``type`` on ``<node>`` and ``<test>``; the name may then be left out.
- ``namespace`` for ``ns`` on node, test, group and include; ``description`` for ``doc``.
- ``<push_ros_namespace namespace="…"/>`` (or with dashes) lasts to the end of its group or file;
  in ROS 2 it also affects the file that includes it.
- ``<let name="…" value="…"/>`` sets an arg, declared or not, to the end of its group or file.
- ``<set_env>`` is an ``<env>`` that ``$(env)`` and ``$(optenv)`` see, too. ``$(var x)`` is
  ``$(arg x)``. ``$(find-pkg-share pkg)`` is the folder of a package.
- ``<executable cmd="…">`` runs a program that is not a node; ``shell`` is not supported.

``<arg>`` and ``<param>`` keep ROS 1's rules: an included file sees only what is passed to it, and a
``<param>`` outside a node is a global parameter. For ``<param from="…">`` there is
``<rosparam file="…">``.
"""

from rosz.launch.plan.context import (
    LaunchArguments,
    LaunchContext,
    LaunchText,
    SystemContext,
    parse_arguments,
)
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
    SetupPlan,
    TestPlan,
    Wait,
)

__all__ = (
    "ArgDoc",
    "Condition",
    "LaunchArguments",
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
    "describe_args",
    "parse_arguments",
    "plan",
)

PUBLIC_MODULES = ("document", "report", "scope", "substitution")
