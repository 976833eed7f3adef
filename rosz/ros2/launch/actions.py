"""launch.actions and launch_ros.actions, apart from those that start a process or read a file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rosz.errors import LaunchError
from rosz.launch.plan import ArgDoc
from rosz.ros2.launch.base import Action, LaunchContext, SubstitutionFailure, make, visit_all
from rosz.ros2.launch.events import add_step, delay, shut_down
from rosz.ros2.launch.process import ExecuteProcess, evaluate, join

_MAX_INCLUDES = 50
"""Maximum depth of includes, which is far within the limit of Python's recursion."""


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
            visit_all(context, context.load(path))
        finally:
            context.includes, context.files = includes, files


def _declare(
    context: LaunchContext,
    name: str,
    *,
    default_value: Any = None,
    description: str | None = None,
    choices: Iterable[str] | None = None,
) -> None:
    settings = context.launch_configurations
    default = None if default_value is None else context.text(default_value)
    context.docs.setdefault(name, ArgDoc(name, description, default))
    if name not in settings and default is None:
        about = f" ({description})" if description else ""
        raise SubstitutionFailure(f"argument '{name}'{about} has no value; give {name}:=VALUE")
    value = settings.setdefault(name, default)
    if choices is not None and value not in [*choices]:
        raise SubstitutionFailure(f"argument '{name}' is '{value}'; expected {', '.join(choices)}")


def _extend(
    context: LaunchContext, name: Any, value: Any, *, prepend: Any = False, separator: Any = ":"
) -> None:
    variable = context.text(name)
    parts = [context.environment.get(variable, ""), context.text(value)]
    parts = parts[::-1] if context.is_true(prepend) else parts
    context.environment[variable] = context.text(separator).join(filter(None, parts))


def _group(
    context: LaunchContext,
    actions: Any,
    *,
    scoped: Any = True,
    forwarding: Any = True,
    launch_configurations: Any = None,
) -> None:
    given = {name: context.text(value) for name, value in (launch_configurations or {}).items()}
    before, variables = dict(context.launch_configurations), dict(context.environment)
    if not context.is_true(forwarding):
        context.launch_configurations = {}
    context.launch_configurations.update(given)
    visit_all(context, actions)
    if context.is_true(scoped):
        context.launch_configurations, context.environment = before, variables


def _push(context: LaunchContext, namespace: Any) -> None:
    settings = context.launch_configurations
    settings["ros_namespace"] = join(settings.get("ros_namespace", "/"), context.text(namespace))


def _add(context: LaunchContext, setting: str, value: Any) -> None:
    """Add a value to a setting whose values reach the nodes that follow."""
    before = context.launch_configurations.get(setting, ())
    context.launch_configurations[setting] = (*before, value)


def _set_parameter(context: LaunchContext, name: Any, value: Any) -> None:
    _add(context, "global_params", {context.text(name): evaluate(context, value)})


_ACTIONS: dict[str, Any] = {
    "AppendEnvironmentVariable": _extend,
    "DeclareLaunchArgument": _declare,
    "GroupAction": _group,
    "EmitEvent": lambda context, event: event.function(context),
    "LogInfo": add_step,
    "OpaqueFunction": lambda context, function, args=(), kwargs=None: function(
        context, *(args or ()), **(kwargs or {})
    ),
    "PushROSNamespace": _push,
    "PushRosNamespace": _push,
    "ROSTimer": delay,
    "RegisterEventHandler": lambda context, event_handler, **_: event_handler.function(context),
    "RosTimer": delay,
    "SetEnvironmentVariable": lambda context, name, value: context.environment.update(
        {context.text(name): context.text(value)}
    ),
    "SetLaunchConfiguration": lambda context, name, value: context.launch_configurations.update(
        {context.text(name): context.text(value)}
    ),
    "SetParameter": _set_parameter,
    "SetParametersFromFile": lambda context, filename: _add(context, "global_params", filename),
    "SetRemap": lambda context, src, dst: _add(context, "ros_remaps", (src, dst)),
    "SetUseSimTime": lambda context, value: _set_parameter(context, "use_sim_time", value),
    "Shutdown": shut_down,
    "TimerAction": delay,
}
_NAMES = (*_ACTIONS, "ExecuteProcess", "IncludeLaunchDescription")
globals().update(make(__name__, Action, _ACTIONS), __all__=_NAMES)
