"""The actions that start programs and nodes, and the parameters of nodes."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, get_args

from rosz import names
from rosz.errors import ParamError, YamlError, near_miss
from rosz.launch.plan import NodePlan
from rosz.params.ros2_file import assign, nest
from rosz.params.yaml import read_plain
from rosz.ros2.launch.base import (
    Action,
    LaunchContext,
    Part,
    Substitution,
    SubstitutionFailure,
    make,
)

_PROCESS = (
    "additional_env cached_output cmd cwd emulate_tty env log_cmd name output output_format"
    " prefix respawn respawn_delay respawn_max_retries shell sigkill_timeout sigterm_timeout"
)
_NODE = "arguments exec_name executable namespace package parameters remappings ros_arguments"
_TYPES: tuple[Any, ...] = (bool, int, float, str, bytes)


class ExecuteProcess(Action):
    """Start a program.

    Attributes:
        plan: The process in the plan, once the action is executed.
    """

    takes = frozenset(_PROCESS.split())
    needs = "cmd"

    def __init__(self, *, condition: Any = None, **options: Any) -> None:
        super().__init__(condition=condition)
        for name in options.keys() - self.takes:
            hint = near_miss(name, self.takes)
            raise SubstitutionFailure(f"{type(self).__name__} takes no '{name}' in rosz{hint}")
        if not options.get(self.needs):
            raise SubstitutionFailure(f"{type(self).__name__} needs '{self.needs}'")
        self._options = options
        self.plan: NodePlan | None = None

    def execute(self, context: LaunchContext) -> None:
        """Add the process to the plan."""
        words = self._words(context, "cmd")
        base = context.builder.unused_name("/", _valid(self._text(context, "name") or words[0]))
        if context.is_true(self._options.get("shell", False)):
            words = ["/bin/sh", "-c", " ".join(words)]
        self._add(context, name=base, namespace="/", package="", type="", command=tuple(words))

    def _text(self, context: LaunchContext, option: str) -> str:
        return context.text(self._options.get(option) or "")

    def _words(self, context: LaunchContext, option: str) -> list[str]:
        """Return the words of an option; a plain text is split as a shell does."""
        value = self._options.get(option)
        if isinstance(value, str | Substitution):
            return shlex.split(context.text(value))
        return [context.text(word) for word in value or ()]

    def _add(self, context: LaunchContext, **fields: Any) -> NodePlan:
        """Add a process with the options that nodes and other programs have."""
        options, before = self._options, context.system.environ
        env = {key: value for key, value in context.environment.items() if before.get(key) != value}
        for key, value in [
            pair for name in ("env", "additional_env") for pair in (options.get(name) or {}).items()
        ]:
            env[context.text(key)] = context.text(value)
        output, most = options.get("output", "log"), options.get("respawn_max_retries", -1)
        shown = isinstance(output, Mapping) or context.text(output) in {"screen", "both", "full"}
        delay = options.get("respawn_delay") or 0.0
        self.plan = NodePlan(
            **fields,
            place=context.place,
            ros2=True,
            launch_prefix=tuple(self._words(context, "prefix")),
            respawn=context.is_true(options.get("respawn", False)),
            respawn_delay=float(delay if isinstance(delay, int | float) else context.text(delay)),
            respawn_max=None if most < 0 else most,
            output="screen" if shown else "log",
            cwd=self._text(context, "cwd") or context.system.cwd,
            env=tuple(env.items()),
        )
        context.builder.add_node(self.plan)
        return self.plan


class Node(ExecuteProcess):
    """Start a node."""

    takes = (ExecuteProcess.takes - {"cmd", "shell"}) | frozenset(_NODE.split())
    needs = "executable"

    def execute(self, context: LaunchContext) -> None:
        """Add the node and its parameters to the plan."""
        program, name = self._text(context, "executable"), self._text(context, "name")
        package, settings = self._text(context, "package"), context.launch_configurations
        ns = join(settings.get("ros_namespace", "/"), self._text(context, "namespace"))
        remaps = [*(self._options.get("remappings") or ()), *settings.get("ros_remaps", ())]
        ros_args = self._words(context, "ros_arguments")
        own = self._options.get("parameters") or ()
        if not isinstance(own, list | tuple):
            raise SubstitutionFailure(f"{type(self).__name__} takes a list of parameters")
        given = [*settings.get("global_params", ()), *own]
        sources = [_read_source(context, each) for each in given]
        plan = self._add(
            context,
            package=package,
            type=program,
            command=() if package else (program,),
            name=names.check_base(name or context.builder.unused_name(ns, _valid(program))),
            named=bool(name),
            namespace=ns,
            args=(*self._words(context, "arguments"), *["--ros-args"] * bool(ros_args), *ros_args),
            remaps=tuple((context.text(old), context.text(new)) for old, new in remaps),
            ros_params=tuple(source for source in sources if source),
        )
        for source in plan.ros_params:
            parts = [(plan.full_name, nest(source))] if isinstance(source, dict) else []
            if isinstance(source, str):
                tree = next(read_plain(context.system.read(source).decode(), source), None) or {}
                try:
                    parts = assign(tree, plan.full_name)
                except ParamError as error:
                    context.warn(f"{source}: {error}")
            for node, values in parts:
                context.builder.add_params(node, values, plan.place)


def _refuse(context: LaunchContext, *_: Any, **__: Any) -> None:  # noqa: ARG001  # an action's
    raise SubstitutionFailure("rosz does not load components, which are compiled; start nodes")


def join(ns: str, name: str) -> str:
    """Return a namespace within another one, or an absolute one, as a global name."""
    return names.check(names.canonical(name if name.startswith("/") else f"{ns}/{name}"))


def _valid(program: str) -> str:
    """Return the name of a node that runs a program."""
    name = re.sub(r"\W", "_", Path(program).name.partition(".")[0], flags=re.ASCII)
    return name if re.match("[A-Za-z]", name) else f"process_{name}"


def _read_source(context: LaunchContext, given: Any) -> Any:
    """Return the path or the values that an item of ``parameters`` stands for."""
    if isinstance(given, Mapping):
        return _flatten(context, given)
    made = isinstance(given, Part) and not isinstance(given, Substitution)
    return given.function(context) if made else _check_file(context, given)


def _check_file(context: LaunchContext, param_file: Any, *, allow_substs: Any = False) -> str:
    """Return the path of a file of parameters, or "" if it cannot be read."""
    path = str(Path(context.system.cwd, context.text(param_file)))
    try:
        data = context.system.read(path)
    except OSError as error:
        context.warn(f"parameter file '{path}' is left out: {error.strerror}")
        return ""
    if context.is_true(allow_substs) and b"$(" in data:
        raise SubstitutionFailure(f"'{path}' has substitutions, which rosz does not apply")
    return path


def _flatten(context: LaunchContext, tree: Mapping[Any, Any], prefix: str = "") -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key, value in tree.items():
        name = prefix + context.text(key)
        try:
            if isinstance(value, Mapping):
                values |= _flatten(context, value, f"{name}.")
            else:
                values[name] = evaluate(context, value)
        except SubstitutionFailure as error:
            raise SubstitutionFailure(f"parameter '{name}': {error}") from error
    return values


def evaluate(context: LaunchContext, value: Any, value_type: Any = None, **_: Any) -> Any:
    """Return the value of a parameter; the text of substitutions is read as YAML.

    Args:
        context: The state of the launch.
        value: The value as the launch file has it.
        value_type: Type that the value has to have, such as ``str`` or ``List[int]``.
    """
    if isinstance(value, _Value):
        return value.function(context)
    parts = value if isinstance(value, list | tuple) else [value]
    substituted = any(isinstance(part, Substitution) for part in parts)
    if all(isinstance(part, str | Substitution) for part in parts) and (
        substituted or (value_type and isinstance(value, str))
    ):
        value = context.text(value) if value_type is str else _parse(context.text(value))
    elif parts is value:
        value = [
            _parse(context.text(part)) if isinstance(part, list | tuple | Part) else part
            for part in parts
        ]
    return _check(value, value_type)


def _parse(written: str) -> Any:
    with suppress(YamlError):
        return next(read_plain(written, "<value>"), None) if written else ""
    return None  # no value of parameters


def _check(value: Any, value_type: Any) -> Any:
    wanted = get_args(value_type) or (value_type,)
    types = set(map(type, value)) if isinstance(value, list) else {type(value)}
    if types <= {int, float} and (wanted[0] is float or len(types) > 1):
        return [float(each) for each in value] if isinstance(value, list) else float(value)
    if len(types) > 1 or not types <= set(wanted if value_type else _TYPES):
        expected = value_type or "a bool, a number, a text or a list of those"
        hint = "for a text, write ParameterValue(…, value_type=str)"
        raise SubstitutionFailure(f"{str(value)[:60]!r} is not {expected}; {hint}")
    return value


class _Value(Part):
    """The value of a parameter, with its type."""


_SOURCES: dict[str, Any] = {
    "Parameter": lambda context, name, value, **options: {
        context.text(name): evaluate(context, value, **options)
    },
    "ParameterFile": _check_file,
}
_COMPONENTS = dict.fromkeys(("ComposableNodeContainer", "LoadComposableNodes"), _refuse)
globals().update(
    make(__name__, Action, _COMPONENTS) | make(__name__, Part, {"ComposableNode": _refuse})
)
globals().update(
    make(__name__, Part, _SOURCES) | make(__name__, _Value, {"ParameterValue": evaluate})
)
