"""The generator that older ``.cfg`` files use; the same as with catkin."""

from __future__ import annotations

import rosz.ros1.roslib as roslib  # noqa: PLR0402  # ROS 1's module has this name
from rosz.ros1.dynamic_reconfigure.parameter_generator_catkin import (
    ParameterGenerator,
    Template,
    bool_t,
    double_t,
    inspect,
    int_t,
    os,
    re,
    str_t,
    sys,
)

__all__ = (
    "ParameterGenerator",
    "Template",
    "bool_t",
    "double_t",
    "inspect",
    "int_t",
    "os",
    "re",
    "roslib",
    "str_t",
    "sys",
)
