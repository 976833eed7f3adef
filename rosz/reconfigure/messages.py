"""Settings as the messages of dynamic_reconfigure, and back.

The ``pack_`` and ``unpack_`` functions translate a `Description` and values. The ``encode_`` and
``decode_`` functions translate trees of dictionaries, which generated modules and the clients of
dynamic_reconfigure use: a group is a dictionary with ``name``, ``type``, ``state``, ``id``,
``parent``, ``parameters`` and ``groups``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from rosz.errors import DecodeError, ParamError
from rosz.msgs.dynamic_reconfigure.msg import (
    BoolParameter,
    ConfigDescription,
    DoubleParameter,
    GroupState,
    IntParameter,
    ParamDescription,
    StrParameter,
)
from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.msg import Group as GroupMessage
from rosz.reconfigure.description import (
    BOUNDS,
    Config,
    Description,
    Group,
    Scalar,
    Setting,
    kind_of,
)

DESCRIPTIONS: Final = "parameter_descriptions"
UPDATES: Final = "parameter_updates"
SET: Final = "set_parameters"
"""Names of the topics and the service of a server, below its namespace."""

_LEVELS: Final = 0xFFFFFFFF
_ROOT: Final = 0
_SETTING_FIELDS: Final = ("name", "default", "description", "level", "min", "max", "edit_method")


def pack_values(values: Mapping[str, Any]) -> ConfigMessage:
    """Return the message of values, each in the list of its type."""
    message = ConfigMessage()
    for name, value in values.items():
        match kind_of(value):
            case "bool":
                message.bools.append(BoolParameter(name, value))
            case "int":
                message.ints.append(IntParameter(name, value))
            case "str":
                message.strs.append(StrParameter(name, value))
            case "double":
                message.doubles.append(DoubleParameter(name, value))
    return message


def unpack_values(message: ConfigMessage) -> dict[str, Any]:
    """Return the values of a message: bools first, then ints, strs and doubles."""
    parts: tuple[Iterable[Any], ...] = (message.bools, message.ints, message.strs, message.doubles)
    return {parameter.name: parameter.value for part in parts for parameter in part}


def unpack_states(message: ConfigMessage) -> dict[int, bool]:
    """Return the states of the groups of a message by id."""
    return {state.id: state.state for state in message.groups}


def pack_description(description: Description) -> ConfigDescription:
    """Return the message of a description."""
    settings = description.settings
    return ConfigDescription(
        groups=[_packed(group, parent) for group, parent in description.groups],
        max=pack_values({name: setting.max for name, setting in settings.items()}),
        min=pack_values({name: setting.min for name, setting in settings.items()}),
        dflt=pack_values({name: setting.default for name, setting in settings.items()}),
    )


def _packed(group: Group, parent: int) -> GroupMessage:
    parameters = [
        ParamDescription(
            setting.name,
            setting.kind or "",
            setting.level & _LEVELS,
            setting.description,
            setting.edit_method,
        )
        for setting in group.settings
    ]
    return GroupMessage(group.name, group.type, parameters, parent, group.id)


def unpack_description(message: ConfigDescription) -> Description:
    """Return the description of a message.

    Raises:
        DecodeError: The message contradicts itself.
    """
    roots = sum(group.id == _ROOT for group in message.groups)
    if roots != 1:
        reason = f"it contradicts itself: {roots} groups have the id 0, expected one"
        raise DecodeError(message._type, -1, reason)
    try:
        return describe(decode_description(message))
    except (ParamError, KeyError, RecursionError) as error:
        raise DecodeError(message._type, -1, f"it contradicts itself: {error}") from error


def describe(config_description: Mapping[str, Any]) -> Description:
    """Return the description that a root group stands for.

    Args:
        config_description: Root group of a generated module, or one that was decoded.

    Raises:
        ParamError: The group contradicts itself.
    """
    return Description(root=_group_of(config_description))


def _group_of(given: Mapping[str, Any]) -> Group:
    return Group(
        name=given["name"],
        settings=tuple(_setting_of(parameter) for parameter in given["parameters"]),
        groups=tuple(map(_group_of, _inner_groups(given))),
        type=given["type"],
        state=bool(given.get("state", True)),
        id=given["id"],
    )


def _setting_of(given: Mapping[str, Any]) -> Setting:
    if given["type"] not in BOUNDS:
        raise ParamError(f"'{given['name']}' is of the unknown type '{given['type']}'")
    return Setting(kind=given["type"], **{field: given[field] for field in _SETTING_FIELDS})


def extract_params(group: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the parameters of a group, then those of the groups in it."""
    return [parameter for inner in _groups_of(group) for parameter in inner["parameters"]]


def _groups_of(group: Any) -> Iterator[Any]:
    yield group
    for inner in _inner_groups(group):
        yield from _groups_of(inner)


def _inner_groups(group: Mapping[str, Any]) -> list[Any]:
    """Return the groups in a group: a list in a generated group, a dict in a decoded one."""
    groups = group["groups"]
    return list(groups.values()) if isinstance(groups, Mapping) else list(groups)


def encode_description(descr: Any) -> ConfigDescription:
    """Return the message that describes a generated module, such as ``my_pkg.cfg.MyConfig``."""
    return pack_description(describe(descr.config_description))


def encode_groups(
    parent: object,  # noqa: ARG001  # part of the public signature
    group: Mapping[str, Any],
) -> list[GroupMessage]:
    """Return the messages of a group and of all groups in it; ``parent`` is ignored."""
    parameters = [
        ParamDescription(
            parameter["name"],
            parameter["type"],
            parameter["level"] & _LEVELS,
            parameter["description"],
            parameter["edit_method"],
        )
        for parameter in group["parameters"]
    ]
    message = GroupMessage(group["name"], group["type"], parameters, group["parent"], group["id"])
    return [
        message,
        *(below for inner in group["groups"] for below in encode_groups(message, inner)),
    ]


def encode_config(config: Mapping[str, Any], flat: bool = True) -> ConfigMessage:
    """Return the message of a configuration, or of a part of one.

    Args:
        config: Values by name, and groups under ``groups``.
        flat: Whether the groups are a tree, which is flattened; otherwise they are a list.
    """
    message = pack_values(
        {name: value for name, value in config.items() if isinstance(value, Scalar)}
    )
    for value in config.values():
        if isinstance(value, Mapping) and flat:
            message.groups += [_state(value), *_inner_states(value)]
        elif isinstance(value, list | Mapping):
            message.groups = [_state(group) for group in value]
    return message


def _inner_states(group: Mapping[str, Any]) -> Iterator[GroupState]:
    for inner in group["groups"].values():
        yield from _inner_states(inner)
        yield _state(inner)


def _state(group: Mapping[str, Any]) -> GroupState:
    return GroupState(group["name"], group["state"], group["id"], group["parent"])


def group_dict(group: Any) -> Config:
    """Return a group of a message as a dictionary, with no groups and parameters yet."""
    return Config(
        id=group.id,
        parent=group.parent,
        name=group.name,
        type=getattr(group, "type", ""),
        state=getattr(group, "state", True),
        groups=Config(),
        parameters=Config(),
    )


def decode_description(msg: ConfigDescription) -> Config:
    """Return the root group of a description, with parameters as lists and groups by name."""
    bounds = {
        "min": decode_config(msg.min),
        "max": decode_config(msg.max),
        "default": decode_config(msg.dflt),
    }
    root = get_tree(msg)
    messages = {group.id: group for group in msg.groups}
    for group in _groups_of(root):
        group["parameters"] = [
            {
                "name": parameter.name,
                **{key: values[parameter.name] for key, values in bounds.items()},
                "type": parameter.type,
                "level": parameter.level,
                "description": parameter.description,
                "edit_method": parameter.edit_method,
            }
            for parameter in messages[group["id"]].parameters
        ]
    return root


def get_tree(m: Any, group: Any = None) -> Config:
    """Return the tree of the groups of a message.

    Args:
        m: Message of type ``Config`` or ``ConfigDescription``.
        group: A group of the message; without it, the root.

    Returns:
        The root, or the groups in ``group`` by name.
    """
    root = group if group is not None else next(member for member in m.groups if member.id == _ROOT)
    inside = Config()
    for member in m.groups:
        if member.id != _ROOT and member.parent == root.id:
            inside[member.name] = group_dict(member)
            inside[member.name]["groups"] = get_tree(m, member)
    if root.id != _ROOT:
        return inside
    tree = group_dict(root)
    tree["groups"] = inside
    return tree


def initial_config(msg: ConfigMessage, description: Mapping[str, Any] | None = None) -> Config:
    """Return the configuration of a message, with the default states of its groups.

    Args:
        msg: Message to decode.
        description: Root group of a generated module; without it, groups are left out.
    """
    config = Config(unpack_values(msg))
    for group, described in _decode_groups(config, msg, description):
        if group["id"] != _ROOT:
            group["state"] = described["state"]
        for parameter in described["parameters"]:
            group["parameters"][parameter["name"]] = config[parameter["name"]]
    return config


def decode_config(msg: ConfigMessage, description: Mapping[str, Any] | None = None) -> Config:
    """Return the configuration of a message.

    Args:
        msg: Message to decode.
        description: Root group, as `decode_description` returns it; without it, groups are left
            out. With it, each group holds its parameters.
    """
    config = Config(unpack_values(msg))
    for group, described in _decode_groups(config, msg, description):
        for parameter in described["parameters"]:
            if parameter["name"] in config:
                group[parameter["name"]] = config[parameter["name"]]
    return config


def _decode_groups(
    config: Config, msg: ConfigMessage, description: Mapping[str, Any] | None
) -> Iterator[tuple[Config, Mapping[str, Any]]]:
    """Add the groups of a message to a configuration; yield those that are described."""
    if not msg.groups or description is None:
        return
    config["groups"] = get_tree(msg)
    described = {group["id"]: group for group in _groups_of(description)}
    for group in _groups_of(config["groups"]):
        if group["id"] in described:
            yield group, described[group["id"]]


def in_groups(config: Config, description: Mapping[str, Any]) -> Config:
    """Return a configuration as `decode_config` returns it: each group holds its parameters.

    Args:
        config: Configuration as `Description.config` returns it.
        description: Root group, as `decode_description` returns it.
    """
    return decode_config(encode_config(config), description)
