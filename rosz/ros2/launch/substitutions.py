"""launch.substitutions, the substitutions of launch_ros, and conditions."""

from __future__ import annotations

import math
import shlex
import shutil
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from rosz.errors import PackageNotFound, near_miss
from rosz.launch.plan.substitution import parse_bool
from rosz.packages import Package
from rosz.ros2.launch.base import (
    LaunchContext,
    Part,
    Substitution,
    SubstitutionFailure,
    make,
    normalize_to_list_of_substitutions,
)


def _configuration(context: LaunchContext, variable_name: Any, default: Any = None) -> str:
    name, settings = context.text(variable_name), context.launch_configurations
    if name not in settings and default is None:
        hint = near_miss(name, settings) or f"; there are: {', '.join(settings) or 'none'}"
        raise SubstitutionFailure(f"there is no launch configuration '{name}'{hint}")
    value = settings.get(name, default)
    return context.text(str(value) if isinstance(value, bool | int | float) else value)


def _variable(context: LaunchContext, name: Any, default_value: Any = None) -> str:
    value = context.environment.get(context.text(name), default_value)
    if value is None:
        raise SubstitutionFailure(f"environment variable '{context.text(name)}' is not set")
    return context.text(value)


def _expression(context: LaunchContext, expression: Any, python_modules: Any = ("math",)) -> str:
    known: dict[str, Any] = dict(vars(math))
    for name in map(context.text, normalize_to_list_of_substitutions(python_modules)):
        module = import_module(name)
        known[module.__name__] = module
    return str(eval(context.text(expression), {}, known))  # noqa: S307  # the user's own


def _program(context: LaunchContext, name: str) -> str:
    """Return the path of a program on the PATH, or in the package of its name."""
    path = shutil.which(name, path=context.environment.get("PATH"))
    with suppress(PackageNotFound):
        path = path or shutil.which(name, path=context.system.find(name))
    if path is None:
        raise SubstitutionFailure(f"there is no program '{name}' on the PATH")
    return path


def _output(context: LaunchContext, command: Any, *, on_stderr: Any = "fail") -> str:  # noqa: ARG001  # stderr is shown
    name, *words = shlex.split(context.text(command))
    return str(context.system.run([_program(context, name), *words]), errors="replace")


def _equal(context: LaunchContext, left: Any, right: Any) -> bool:
    texts = context.text(left), context.text(right)
    for convert in (parse_bool, float):
        with suppress(ValueError):
            return math.isclose(*map(convert, texts))
    return texts[0] == texts[1]


def _executable(context: LaunchContext, executable: Any, package: Any) -> Path:
    name = context.text(package)
    return Package(name, Path(context.system.find(name))).executable(context.text(executable))


def _prefix(context: LaunchContext, package: Any) -> Path:
    folder = Path(context.system.find(context.text(package)))
    return folder.parent.parent if folder.parent.name == "share" else folder


def _has_value(context: LaunchContext, name: Any, expected_value: Any) -> bool:
    expected = None if expected_value is None else context.text(expected_value)
    return bool(context.launch_configurations.get(context.text(name)) == expected)


_SUBSTITUTIONS: dict[str, Any] = {
    "AnyLaunchDescriptionSource": LaunchContext.text,
    "AndSubstitution": lambda context, *args: all(map(context.is_true, args)),
    "Command": _output,
    "EnvironmentVariable": _variable,
    "EqualsSubstitution": _equal,
    "ExecutableInPackage": _executable,
    "FileContent": lambda context, path: context.system.read(context.text(path)).decode(),
    "FindExecutable": lambda context, name: _program(context, context.text(name)),
    "FindPackagePrefix": _prefix,
    "FindPackageShare": lambda context, package: context.system.find(context.text(package)),
    "FrontendLaunchDescriptionSource": LaunchContext.text,
    "LaunchConfiguration": _configuration,
    "NotEqualsSubstitution": lambda context, left, right: not _equal(context, left, right),
    "NotSubstitution": lambda context, value: not context.is_true(value),
    "OrSubstitution": lambda context, *args: any(map(context.is_true, args)),
    "PathJoinSubstitution": lambda context, substitutions: Path(*map(context.text, substitutions)),
    "PathSubstitution": LaunchContext.text,
    "PythonExpression": _expression,
    "PythonLaunchDescriptionSource": LaunchContext.text,
    "XMLLaunchDescriptionSource": LaunchContext.text,
    "YAMLLaunchDescriptionSource": LaunchContext.text,
    "TextSubstitution": lambda _, text: text,
    "ThisLaunchFile": lambda context: context.files[-1],
    "ThisLaunchFileDir": lambda context: Path(context.files[-1]).parent,
}
_CONDITIONS: dict[str, Any] = {
    "IfCondition": LaunchContext.is_true,
    "LaunchConfigurationEquals": _has_value,
    "LaunchConfigurationNotEquals": lambda context, *args: not _has_value(context, *args),
    "UnlessCondition": lambda context, value: not context.is_true(value),
}
globals().update(make(__name__, Substitution, _SUBSTITUTIONS) | make(__name__, Part, _CONDITIONS))
globals()["FindPackageShare"].find = lambda _, package: LaunchContext().system.find(package)
