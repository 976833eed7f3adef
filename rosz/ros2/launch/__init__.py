"""launch and launch_ros: ROS 2's launch files in Python, which become plans.

`rosz.ros1.modules` has the other modules of both, and the names in them.
"""

from logging import getLogger as get_logger  # noqa: N813  # launch's
from typing import Any as SomeSubstitutionsType

from rosz.ros2.launch import actions, events, substitutions
from rosz.ros2.launch.base import Action, LaunchContext, LaunchDescription, Substitution
from rosz.ros2.launch.base import Action as LaunchDescriptionEntity
from rosz.ros2.launch.base import Part as Condition
from rosz.ros2.launch.source import describe_args, plan
