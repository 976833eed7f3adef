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
from rosz.launch.plan.substitution import substitute
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
from rosz.ros2.launch.events import handle

_PROCESS = (
    "additional_env cached_output cmd cwd emulate_tty env log_cmd name on_exit output output_format"
    " prefix respawn respawn_delay respawn_max_retries shell sigkill_timeout sigterm_timeout"
)
_NODE = "arguments exec_name executable namespace package parameters remappings ros_arguments"
_TYPES: tuple[Any, ...] = (bool, int, float, str, bytes)


class ExecuteProcess(Action):
    """Start a program; ``plan`` is the process in the plan, once the action is executed."""

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

    def _add(self, context: LaunchContext, **fields: Any) -> None:
        """Add a process with the options that nodes and other programs have."""
        options, before = self._options, context.system.environ
        env = {key: value for key, value in context.environment.items() if before.get(key) != value}
        given = {**(options.get("env") or {}), **(options.get("additional_env") or {})}
        env |= {context.text(key): context.text(value) for key, value in given.items()}
        output, most = options.get("output", "log"), options.get("respawn_max_retries", -1)
        shown = isinstance(output, Mapping) or context.text(output) in {"screen", "both", "full"}
        delay = options.get("respawn_delay") or 0.0
        if options.get("on_exit") is not None:
            handle(context, "exit", self, options["on_exit"])
        self.plan = NodePlan(
            **fields,
            after=context.timing[0],
            spawn_delay=context.timing[1],
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
        base = names.check_base(name or context.builder.unused_name(ns, _valid(program)))
        sources: list[Any] = []
        for each in (*settings.get("global_params", ()), *own):
            source, parts = _read_source(context, each, names.join(ns, base))
            sources += [source] if source else []
            for below, values in parts:
                context.builder.add_params(below, values, context.place)
        self._add(
            context,
            package=package,
            type=program,
            command=() if package else (program,),
            name=base,
            named=bool(name),
            namespace=ns,
            args=(*self._words(context, "arguments"), *["--ros-args"] * bool(ros_args), *ros_args),
            remaps=tuple((context.text(old), context.text(new)) for old, new in remaps),
            ros_params=tuple(sources),
        )


def join(ns: str, name: str) -> str:
    """Return a namespace within another one, or an absolute one, as a global name."""
    return names.check(names.canonical(name if name.startswith("/") else f"{ns}/{name}"))


def _valid(program: str) -> str:
    """Return the name of a node that runs a program."""
    name = re.sub(r"\W", "_", Path(program).name.partition(".")[0], flags=re.ASCII)
    return name if re.match("[A-Za-z]", name) else f"process_{name}"


def _read_source(context: LaunchContext, given: Any, node: str) -> tuple[Any, list[Any]]:
    """Return an item of ``parameters`` as a path or values, and those below a node's name."""
    if isinstance(given, _Value):  # with a name
        given = {given.name: given}
    if isinstance(given, Mapping):
        values = _flatten(context, given)
        return values, [(node, nest(values))]
    path = str(Path(context.system.cwd, context.text(getattr(given, "param_file", given))))
    try:
        written = context.system.read(path).decode()
        substituted = "$(" in written and context.is_true(getattr(given, "allow_substs", False))
        if substituted:
            settings = context.launch_configurations.items()
            texts = {name: value for name, value in settings if isinstance(value, str)}
            written = substitute(written, context.system, texts, {}, path)
        parts = assign(next(read_plain(written, path), None) or {}, node)
    except (OSError, ParamError) as error:
        context.warn(f"parameter file '{path}' is left out: {error}")
        return "", []
    if not substituted:
        return path, parts
    return {key: each for _, tree in parts for key, each in _flatten(context, tree).items()}, parts


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
    """Return the value of a parameter; the text of substitutions is read as YAML."""
    if isinstance(value, _Value):
        return evaluate(context, value.value, getattr(value, "value_type", None))
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
    """The value of a parameter, or a whole parameter with its name."""

    name: Any
    value: Any


def _refuse(context: LaunchContext, *_: Any, **__: Any) -> None:  # noqa: ARG001  # an action's
    raise SubstitutionFailure("rosz does not load components, which are compiled; start nodes")


# Of those that only hold their arguments, the functions return these.
_COMPONENTS = dict.fromkeys(("ComposableNodeContainer", "LoadComposableNodes"), _refuse)
_FILES: dict[str, Any] = {
    "ComposableNode": _refuse,
    "ParameterFile": lambda _, param_file, *, allow_substs=False: (param_file, allow_substs),
}
_VALUES: dict[str, Any] = {
    "Parameter": lambda _, name, value, *, value_type=None: (name, value, value_type),
    "ParameterValue": evaluate,
}
globals().update(make(__name__, Action, _COMPONENTS) | make(__name__, Part, _FILES))
globals().update(make(__name__, _Value, _VALUES))
