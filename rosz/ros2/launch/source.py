"""Launch files of ROS 2: reading them into a plan, and including one in another."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from types import ModuleType

from rosz.errors import LaunchError, LaunchFileError, near_miss
from rosz.launch.plan import ArgDoc, Notice, Place, Plan
from rosz.launch.plan import LaunchContext as LaunchSystem
from rosz.ros2.launch.base import LaunchContext, LaunchDescription, refusing, visit_all
from rosz.ros2.launch.events import execute_handlers
from rosz.ros2.launch.frontend import read

_MODULE = "python_launch_file"


def plan(
    files: Sequence[str], args: Mapping[str, str], system: LaunchSystem, *, ns: str = ""
) -> Plan:
    """Read launch files of ROS 2 into a plan, as `rosz.launch.plan.plan` does with ROS 1's."""
    context = LaunchContext(args, ns, system=system)
    context.load = partial(_load, context)
    for file in files:
        with refusing(Place(file), ()):
            visit_all(context, _load(context, file))
            execute_handlers(context)
    unused = tuple(name for name in args if name not in context.docs)
    for name in unused:
        reason = f"no file declares '{name}', so it may do nothing{near_miss(name, context.docs)}"
        context.builder.warnings.append(Notice(reason, Place("<command line>")))
    return context.builder.build(unused)


def describe_args(
    files: Sequence[str], args: Mapping[str, str], system: LaunchSystem, *, ns: str = ""
) -> tuple[ArgDoc, ...]:
    """Return the arguments that launch files declare, as far as the files can be executed."""
    context = LaunchContext(args, ns, system=system)
    context.load = partial(_load, context)
    for file in files:
        for entity in _load(context, file).entities:
            with suppress(LaunchFileError):  # of what needs an argument that is not given
                visit_all(context, entity)
    return tuple(context.docs.values())


def _load(context: LaunchContext, path: str) -> LaunchDescription:
    """Make the launch description of a file, which becomes the innermost one."""
    absolute = os.path.normpath(os.path.join(context.system.cwd, path))  # noqa: PTH118  # as text
    context.files.append(absolute)
    with refusing(Place(path), context.includes):
        try:
            data = context.system.read(path)
        except OSError as error:
            raise LaunchError(f"the launch file cannot be read: {error.strerror}") from error
        context.builder.files.setdefault(absolute)
        if not path.endswith(".py"):
            return read(path, data)
        module = ModuleType(_MODULE)
        module.__file__ = absolute
        sys.modules[_MODULE] = module  # where dataclasses look for the module of a class
        exec(compile(data, path, "exec"), vars(module))  # noqa: S102  # what the user starts
        description = vars(module).get("generate_launch_description", lambda: None)()
        if not isinstance(description, LaunchDescription):
            raise LaunchError(
                "expected generate_launch_description() to return a LaunchDescription"
            )
        return description
