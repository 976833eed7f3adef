"""Launch files of ROS 2 in XML and YAML: their tags become the objects of those in Python."""

from __future__ import annotations

import shlex
from typing import Any

import yaml

from rosz.errors import LaunchFileError, near_miss
from rosz.launch.plan import Document, Element, Place, parse
from rosz.ros2.launch import actions, process, substitutions
from rosz.ros2.launch.base import (
    LaunchContext,
    LaunchDescription,
    Substitution,
    SubstitutionFailure,
    refusing,
)

_CALLS = {
    "command": "Command",
    "dirname": "ThisLaunchFileDir",
    "env": "EnvironmentVariable",
    "eval": "PythonExpression",
    "exec-in-pkg": "ExecutableInPackage",
    "file-content": "FileContent",
    "filename": "ThisLaunchFile",
    "find-exec": "FindExecutable",
    "find-pkg-prefix": "FindPackagePrefix",
    "find-pkg-share": "FindPackageShare",
    "not": "NotSubstitution",
    "var": "LaunchConfiguration",
    "and": "AndSubstitution",
    "equals": "EqualsSubstitution",
    "or": "OrSubstitution",
    "not-equals": "NotEqualsSubstitution",
}
_ACTIONS = {
    "append_env": "AppendEnvironmentVariable",
    "arg": "DeclareLaunchArgument",
    "executable": "ExecuteProcess",
    "group": "GroupAction",
    "include": "IncludeLaunchDescription",
    "let": "SetLaunchConfiguration",
    "log": "LogInfo",
    "node": "Node",
    "push_ros_namespace": "PushROSNamespace",
    "set_env": "SetEnvironmentVariable",
    "set_parameter": "SetParameter",
    "set_parameters_from_file": "SetParametersFromFile",
    "set_remap": "SetRemap",
    "set_use_sim_time": "SetUseSimTime",
    "shutdown": "Shutdown",
    "timer": "TimerAction",
}
_NAMES = {
    "args": "arguments",
    "exec": "executable",
    "from": "src",
    "launch_prefix": "prefix",
    "message": "msg",
    "pkg": "package",
    "ros_args": "ros_arguments",
    "to": "dst",
}
_MADE: dict[str, Any] = {**vars(process), **vars(actions), **vars(substitutions)}
_TYPES = {kind.__name__: kind for kind in (bool, float, int, str)}


class Text(Substitution):
    """A text that may hold ``$(NAME WORDS)``, also one inside another."""

    def __init__(self, written: str) -> None:
        self.written = written
        self.function = self._expand

    def _expand(self, context: LaunchContext) -> str:
        text, start = self.written, len(self.written)
        while (start := text.rfind("$(", 0, start)) >= 0:
            ends = (end for end in range(start + 2, len(text) + 1) if _is_closed(text[start:end]))
            end = next(ends, 0)
            name, *words = shlex.split(text[start + 2 : end - 1]) or [""]
            if not end or name not in _CALLS:
                hint = near_miss(name, _CALLS) if end else "; ')' is missing"
                raise SubstitutionFailure(f"'{text[start:]}' is not a substitution{hint}")
            words = [" ".join(words)] if name in {"command", "eval"} else words
            value = context.text(_MADE[_CALLS[name]](*words))
            text = f"{text[:start]}{value}{text[end:]}"
        return text


def _is_closed(text: str) -> bool:
    return text.count("(") == text.count(")")


def read(path: str, data: bytes) -> LaunchDescription:
    """Return the launch description of a file in XML, or in YAML by its name."""
    document = Document(path, data) if path.endswith((".yaml", ".yml")) else parse(path, data)
    if not path.endswith(".xml"):
        try:
            tree: Any = yaml.compose(data.decode(), Loader=yaml.SafeLoader)
        except yaml.MarkedYAMLError as error:
            mark: Any = error.problem_mark
            reason = f"not YAML: {error.problem}"
            raise LaunchFileError(reason, path, mark.line + 1, mark.column + 1) from error
        if not isinstance(tree, yaml.MappingNode) or tree.value[0][0].value != "launch":
            raise SubstitutionFailure("the file has to hold one list, named 'launch'")
        document.launch = _element(document, "launch", tree.value[0][1])
    return LaunchDescription([_action(element) for element in document.launch.children])


def _element(document: Document, tag: str, node: Any) -> Element:
    """Return what a node of YAML is in XML: texts are attributes, and lists hold children."""
    place = node.start_mark.line + 1, node.start_mark.column + 1, 0
    element = Element(document, tag, {}, place)
    pairs = [("children", node)]
    if not isinstance(node, yaml.SequenceNode):
        pairs = [(key.value, value) for key, value in node.value or ()]
    for name, value in pairs:
        if isinstance(value, yaml.ScalarNode):
            element.attributes[name] = value.value
        elif name == "value":
            element.attributes[name] = f"[{', '.join(item.value for item in value.value)}]"
        elif name == "children":
            inside = (pair for item in value.value for pair in item.value)
            element.children += [_element(document, key.value, inner) for key, inner in inside]
        else:
            element.children += [_element(document, name, item) for item in value.value]
    return element


def _action(element: Element) -> Any:
    """Return the action of a tag.

    Raises:
        LaunchFileError: The tag is unknown, or has wrong attributes.
    """
    place = Place(element.file, element.line, element.column)
    with refusing(place, ()):
        tag = element.tag.replace("-", "_")
        texts = {name.replace("-", "_"): Text(value) for name, value in element.attributes.items()}
        when, unless = texts.pop("if", None), texts.pop("unless", None)
        try:
            made = _make(tag, element, texts)
        except KeyError as error:
            raise SubstitutionFailure(f"<{tag}>, or a tag in it, needs {error}") from error
        made.place = place
        if when or unless:
            kind = "IfCondition" if when else "UnlessCondition"
            made.condition = _MADE[kind](when or unless)
        return made


def _make(tag: str, element: Element, texts: dict[str, Any]) -> Any:
    if tag not in _ACTIONS:
        raise SubstitutionFailure(f"<{tag}> is not a tag of ROS 2{near_miss(tag, _ACTIONS)}")
    made = _MADE[_ACTIONS[tag]]
    if tag == "arg":
        choices = [child.attributes["value"] for child in element.children] or None
        own = {"default_value": texts.get("default"), "choices": choices}
        name, about = element.attributes["name"], element.attributes.get("description")
        return made(name, description=about, **own)
    if tag == "include":
        return made(texts["file"], launch_arguments=_pairs(element, "arg"))
    options = {_NAMES.get(name, name): text for name, text in texts.items()}
    if tag in {"node", "executable"}:
        options["additional_env"] = dict(_pairs(element, "env"))
    if tag == "node":
        options["remappings"] = _pairs(element, "remap", "from", "to")
        options["parameters"] = [_param(each) for each in element.children if each.tag == "param"]
    if tag in {"group", "timer"}:
        options["actions"] = [_action(child) for child in element.children]
    return made(**options)


def _pairs(
    element: Element, tag: str, left: str = "name", right: str = "value"
) -> list[tuple[Text, Text]]:
    """Return two attributes of each child with a tag."""
    given = [child.attributes for child in element.children if child.tag == tag]
    return [(Text(each[left]), Text(each[right])) for each in given]


def _param(element: Element) -> Any:
    """Return the item of ``parameters`` that a tag stands for."""
    texts = {name: Text(value) for name, value in element.attributes.items()}
    if "from" in texts:
        return _MADE["ParameterFile"](texts["from"], allow_substs=texts.get("allow_substs", False))
    if "value" not in texts:
        below = [_param(child).items() for child in element.children]
        return {texts["name"]: dict(pair for pairs in below for pair in pairs)}
    kind = _TYPES.get(element.attributes.get("type", ""))
    return {texts["name"]: _MADE["ParameterValue"](texts["value"], value_type=kind)}
