"""Launch files of ROS 2: reading them into a plan, and including one in another."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from types import ModuleType
from typing import Any

from rosz.errors import LaunchError, LaunchFileError, near_miss
from rosz.launch.plan import ArgDoc, Notice, Place, Plan
from rosz.launch.plan import LaunchContext as LaunchSystem
from rosz.ros2.launch.base import Action, LaunchContext, LaunchDescription, refusing, visit_all
from rosz.ros2.launch.events import execute_handlers

_MAX_INCLUDES = 50
"""Maximum depth of includes, which is far within the limit of Python's recursion."""
_MODULE = "python_launch_file"


def plan(
    files: Sequence[str], args: Mapping[str, str], system: LaunchSystem, *, ns: str = ""
) -> Plan:
    """Read launch files of ROS 2 into a plan, as `rosz.launch.plan.plan` does with ROS 1's."""
    context = LaunchContext(args, ns, system=system)
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
            raise LaunchError("the file is not in Python; expected a name that ends in .py")
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


class IncludeLaunchDescription(Action):
    """Execute another launch file with some arguments."""

    def __init__(
        self, launch_description_source: Any, *, launch_arguments: Any = None, condition: Any = None
    ) -> None:
        super().__init__(condition=condition)
        self.launch_description_source = launch_description_source
        self.launch_arguments: tuple[Any, ...] = tuple(launch_arguments or ())

    def execute(self, context: LaunchContext) -> None:
        """Set the arguments, and execute the file."""
        path = context.text(self.launch_description_source)
        for name, value in self.launch_arguments:
            context.launch_configurations[context.text(name)] = context.text(value)
        includes, files = context.includes, context.files
        if len(includes) >= _MAX_INCLUDES:
            raise LaunchError(f"includes nest deeper than {_MAX_INCLUDES}, at '{path}'")
        context.includes, context.files = (*includes, str(self.place)), [*files]
        try:
            visit_all(context, _load(context, path))
        finally:
            context.includes, context.files = includes, files
