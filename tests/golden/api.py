"""The public API as lines of text: one per name, method, property and field."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from enum import Enum
from functools import cache, cached_property
from importlib import import_module
from types import ModuleType
from typing import Any

import msgspec

__all__ = ("MODULES", "signatures")

_TABLE = {
    "rosz": "errors qos time names params reconfigure transforms message idl typestore launch.plan "
    "node ros1",
    "rospy": "client core exceptions impl.tcpros impl.tcpros_base impl.tcpros_service msg msproxy "
    "names numpy_msg rostime service timer topics",
    "rosparam": "",
    "rosgraph": "masterapi names network rosenv",
    "rospkg": "common environment manifest rospack",
    "roslib": "launcher message names packages rospack",
    "rostopic": "",
    "rosservice": "",
    "rosnode": "",
    "rosmsg": "",
    "genpy": "message rostime",
    "genmsg": "names",
    "message_filters": "",
    "actionlib": "action_client action_server exceptions goal_id_generator handle_tracker_deleter "
    "server_goal_handle simple_action_client simple_action_server status_tracker",
    "smach": "concurrence container exceptions iterator log sequence state state_machine user_data "
    "util",
    "smach_ros": "action_server_wrapper condition_state introspection monitor_state ros_state "
    "service_state simple_action_state util",
    "tf": "broadcaster listener transformations",
    "tf_transformations": "",
    "tf2_ros": "buffer buffer_client buffer_interface buffer_server static_transform_broadcaster "
    "transform_broadcaster transform_listener",
    "tf2_py": "",
    "tf2_geometry_msgs": "",
    "tf2_sensor_msgs": "",
    "PyKDL": "",
    "tf_conversions": "posemath",
    "tf2_kdl": "",
    "dynamic_reconfigure": "client encoding exceptions parameter_generator "
    "parameter_generator_catkin server",
    "rostest": "",
    "rosunit": "",
    "rclpy": "callback_groups client clock clock_type constants context duration event_handler "
    "exceptions executors guard_condition lifecycle logging node parameter parameter_client "
    "publisher qos qos_overriding_options serialization service signals subscription "
    "task time timer utilities wait_for_message",
    "sensor_msgs_py": "point_cloud2",
}
"""Packages and their public modules, by the names that users import."""

MODULES = [
    f"{package}.{name}".rstrip(".")
    for package, names in _TABLE.items()
    for name in ("", *names.split())
]
"""Every public module; a class is described in the first one that has it."""

_ROOTS = set(_TABLE)
_PATH = re.compile(r"\b(?:[a-z_]\w*\.)+(?=[A-Za-z_])")
_LONGEST = 60
_PLAIN = (bool, bytes, dict, float, frozenset, int, list, str, tuple, type(None))
_STARS: dict[Any, str] = {
    inspect.Parameter.VAR_POSITIONAL: "*",
    inspect.Parameter.VAR_KEYWORD: "**",
}


def signatures(module: str) -> str:
    """Return the names of a module with their kinds and signatures."""
    return "".join(f"{line}\n" for line in _Module(module).lines())


class _Module:
    """The lines of one module.

    Args:
        name: The name that users import.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._module = _load(name)

    def lines(self) -> Iterator[str]:
        """Yield the lines of all names."""
        for name, value in _public(self._module):
            home = _home(value, self._name)
            if home != self._name:
                yield f"{name}: the one of {home}"
            elif isinstance(value, type) and _is_ours(value):
                yield from _class(name, value)
            else:
                yield f"{name}{_value(value)}"


def _public(module: ModuleType) -> list[tuple[str, Any]]:
    names = getattr(module, "__all__", None)
    if names is None:
        names = [name for name in vars(module) if not name.startswith("_")]
    return [(name, getattr(module, name)) for name in sorted(names)]


def _is_ours(value: object) -> bool:
    if not (inspect.isclass(value) or inspect.isroutine(value)):
        return False
    return str(getattr(value, "__module__", "")).partition(".")[0] in _ROOTS


def _load(name: str) -> ModuleType:
    import_module("rosz.ros1").install()
    return import_module(name)


def _home(value: object, default: str = "") -> str:
    """Return the first public module that has one of our classes or functions."""
    return _homes().get(id(value), (default, None))[0]


@cache
def _homes() -> dict[int, tuple[str, object]]:
    """Return the first public module of each object by its id, and the object to keep the id."""
    found: dict[int, tuple[str, object]] = {}
    for module in MODULES:
        for _, value in _public(_load(module)):
            if _is_ours(value):
                found.setdefault(id(value), (module, value))
    return found


def _class(name: str, value: type) -> Iterator[str]:
    bases = [one.__name__ for one in value.__mro__[1:-1] if _is_known(one)]
    bases = [name for name in bases if name != "BaseException"]
    yield f"class {name}({', '.join(bases)}){_constructor(value)}"
    if issubclass(value, msgspec.Struct):
        for field in msgspec.structs.fields(value):
            yield f"  {name}.{field.name}: {_type(_annotation(value, field.name))}{_of(field)}"
    for key, member in _members(value):
        yield f"  {name}.{key}{_value(member)}"


def _is_known(value: type) -> bool:
    """Tell whether a base class is public: what is inherited from others is listed as own."""
    return bool(_home(value)) or value.__module__ == "builtins"


def _members(value: type) -> list[tuple[str, Any]]:
    """Return what a class, and those of its bases that are ours, have beside fields."""
    fields = set(value.__struct_fields__) if issubclass(value, msgspec.Struct) else set()
    found: dict[str, Any] = {}
    for base in value.__mro__:
        if _is_ours(base):
            for key, member in vars(base).items():
                found.setdefault(key, member)
    if issubclass(value, Enum):
        found |= dict(value.__members__)
    return sorted(
        (key, one) for key, one in found.items() if not key.startswith("_") and key not in fields
    )


def _annotation(value: type, field: str) -> object:
    return next(
        found[field] for base in value.__mro__ if field in (found := inspect.get_annotations(base))
    )


def _of(field: Any) -> str:
    if field.default is not msgspec.NODEFAULT:
        return f" = {_plain(field.default)}"
    if field.default_factory is not msgspec.NODEFAULT:
        made = field.default_factory
        return f" = {getattr(made, '__name__', repr(made))}()"
    return ""


def _constructor(value: type) -> str:
    """Return the signature of a class whose constructor is ours."""
    if issubclass(value, msgspec.Struct) and "__init__" not in vars(value):
        frozen = "frozen " if value.__struct_config__.frozen else ""
        keyword = _first_keyword(value)
        return f" {frozen}struct" + (f", by keyword from {keyword}" if keyword else "")
    for name in ("__init__", "__new__"):
        method = getattr(value, name)
        if inspect.isfunction(method) and _is_ours(method) and not issubclass(value, Enum):
            return _signature(method)
    return ""


def _first_keyword(value: type) -> str | None:
    each = inspect.signature(value).parameters.values()
    return next((one.name for one in each if one.kind is one.KEYWORD_ONLY), None)


def _value(value: Any) -> str:
    """Return what follows the name of a value: its kind, its signature, or the value itself."""
    if isinstance(value, staticmethod | classmethod):
        return f": {type(value).__name__}{_signature(value.__func__)}"
    if inspect.isfunction(value) or inspect.ismethod(value):
        return f": function{_signature(value)}"
    if isinstance(value, property | cached_property):
        getter: Any = value.fget if isinstance(value, property) else value.func
        setter = ", can be set" if isinstance(value, property) and value.fset else ""
        return f": property -> {_type(inspect.signature(getter).return_annotation)}{setter}"
    if isinstance(value, Enum) or type(value) in _PLAIN:
        text = _plain(value)
        return f" = {text}" if len(text) <= _LONGEST else f": {type(value).__name__}"
    return f": {_kind(value)}"


def _kind(value: Any) -> str:
    if isinstance(value, type):
        return f"class {value.__name__}"
    if inspect.ismodule(value):
        return "module"
    if inspect.ismemberdescriptor(value):
        return "attribute"
    return type(value).__name__ if _is_known(type(value)) else "object"


def _signature(function: Any) -> str:
    signature = inspect.signature(function)
    kinds, parts = [one.kind for one in signature.parameters.values()], []
    for place, one in enumerate(signature.parameters.values()):
        if one.kind is one.KEYWORD_ONLY and not {one.VAR_POSITIONAL, one.KEYWORD_ONLY} & {
            *kinds[:place]
        }:
            parts.append("*")
        kind = "" if one.annotation is one.empty else f": {_type(one.annotation)}"
        default = "" if one.default is one.empty else f" = {_plain(one.default)}"
        parts.append(f"{_STARS.get(one.kind, '')}{one.name}{kind}{default}")
        if one.kind is one.POSITIONAL_ONLY and one.POSITIONAL_ONLY not in kinds[place + 1 :]:
            parts.append("/")
    empty = signature.return_annotation is signature.empty
    result = "" if empty else f" -> {_type(signature.return_annotation)}"
    return f"({', '.join(parts)}){result}"


def _type(annotation: object) -> str:
    """Return an annotation without the paths of modules."""
    if annotation is inspect.Signature.empty:
        return "?"
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return _PATH.sub("", text)


def _plain(value: object) -> str:
    """Return a value that reads the same in each process."""
    if isinstance(value, Enum):
        return f"{type(value).__name__}.{value.name}"
    if isinstance(value, type) or inspect.isroutine(value):
        return value.__name__
    if isinstance(value, frozenset | set):
        return f"{{{', '.join(sorted(map(_plain, value)))}}}"
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_plain, value))}]"
    text = repr(value)
    return "..." if text.startswith("<") or " object at " in text else _PATH.sub("", text)


def _first_line(value: object) -> str:
    if isinstance(value, staticmethod | classmethod):
        value = value.__func__
    if not (inspect.ismodule(value) or _is_ours(value) or isinstance(value, property)):
        return ""
    return (inspect.cleandoc(value.__doc__ or "").splitlines() or [""])[0]
