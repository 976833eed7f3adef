"""Configurations and descriptions as dictionaries, and as messages (ROS 1's data, its names)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMsg
from rosz.msgs.dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from rosz.msgs.dynamic_reconfigure.msg import Group as GroupMsg
from rosz.msgs.dynamic_reconfigure.msg import GroupState, ParamDescription
from rosz.reconfigure.config import Config
from rosz.reconfigure.messages import pack_values, unpack_values
from rosz.reconfigure.setting import Scalar

__all__ = (
    "Config",
    "decode_config",
    "decode_description",
    "encode_config",
    "encode_description",
    "encode_groups",
    "extract_params",
    "get_tree",
    "group_dict",
    "in_groups",
    "initial_config",
)

_ROOT = 0
_LEVELS = 0xFFFFFFFF


def extract_params(group: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the parameters of a group, then those of the groups inside it."""
    return [*group["parameters"], *(p for one in _inner(group) for p in extract_params(one))]


def _inner(group: Mapping[str, Any]) -> list[Any]:
    """Return the groups inside a group: a list where generated, by name where decoded."""
    groups = group["groups"]
    return list(groups.values()) if isinstance(groups, Mapping) else list(groups)


def encode_description(descr: Any) -> ConfigDescrMsg:
    """Return the message that describes a generated module."""
    return ConfigDescrMsg(
        groups=encode_groups(None, descr.config_description),
        max=encode_config(descr.max),
        min=encode_config(descr.min),
        dflt=encode_config(descr.defaults),
    )


def encode_groups(
    parent: object,  # noqa: ARG001  # ROS 1's signature
    group: Mapping[str, Any],
) -> list[GroupMsg]:
    """Return the messages of a group and of all inside it; ``parent`` is not looked at."""
    parameters = [
        ParamDescription(
            one["name"],
            one["type"],
            one["level"] & _LEVELS,
            one["description"],
            one["edit_method"],
        )
        for one in group["parameters"]
    ]
    message = GroupMsg(group["name"], group["type"], parameters, group["parent"], group["id"])
    return [message, *(one for inner in group["groups"] for one in encode_groups(message, inner))]


def encode_config(config: Mapping[str, Any], flat: bool = True) -> ConfigMsg:
    """Return the message of a configuration, or of part of one.

    Args:
        config: Name to value, and a tree of groups under ``groups``.
        flat: Whether that is a tree; else it is a list of groups.
    """
    message = pack_values({name: one for name, one in config.items() if isinstance(one, Scalar)})
    for one in config.values():
        if isinstance(one, Mapping) and flat:
            message.groups += [_state(one), *_states_inside(one)]
        elif isinstance(one, list | Mapping):
            message.groups = [_state(group) for group in one]
    return message


def _states_inside(group: Mapping[str, Any]) -> Iterator[GroupState]:
    for inner in group["groups"].values():
        yield from _states_inside(inner)
        yield _state(inner)


def _state(group: Mapping[str, Any]) -> GroupState:
    return GroupState(group["name"], group["state"], group["id"], group["parent"])


def group_dict(group: Any) -> Config:
    """Return a group of a message as a dictionary, with nothing in it yet."""
    return Config(
        id=group.id,
        parent=group.parent,
        name=group.name,
        type=getattr(group, "type", ""),
        state=getattr(group, "state", True),
        groups=Config(),
        parameters=Config(),
    )


def decode_description(msg: ConfigDescrMsg) -> Config:
    """Return the root group of a description: parameters are lists, groups are by name."""
    bounds = {
        "min": decode_config(msg.min),
        "max": decode_config(msg.max),
        "default": decode_config(msg.dflt),
    }
    root = get_tree(msg)
    messages = {group.id: group for group in msg.groups}
    for group in _all(root):
        group["parameters"] = [
            {
                "name": one.name,
                **{key: values[one.name] for key, values in bounds.items()},
                "type": one.type,
                "level": one.level,
                "description": one.description,
                "edit_method": one.edit_method,
            }
            for one in messages[group["id"]].parameters
        ]
    return root


def _all(group: Config) -> Iterator[Config]:
    yield group
    for inner in group["groups"].values():
        yield from _all(inner)


def get_tree(m: Any, group: Any = None) -> Config:
    """Return the groups of a message as a tree.

    Args:
        m: A `Config` or `ConfigDescription` message.
        group: One of its groups, for those inside it by name; else the root is returned.
    """
    root = group if group is not None else next(one for one in m.groups if one.id == _ROOT)
    inside = Config()
    for one in m.groups:
        if one.id != _ROOT and one.parent == root.id:
            inside[one.name] = group_dict(one)
            inside[one.name]["groups"] = get_tree(m, one)
    if root.id != _ROOT:
        return inside
    tree = group_dict(root)
    tree["groups"] = inside
    return tree


def initial_config(msg: ConfigMsg, description: Mapping[str, Any] | None = None) -> Config:
    """Return the configuration of a message, with the states that groups have at first.

    Args:
        msg: The message.
        description: The root group of a generated module; groups are left out without one.
    """
    config = Config(unpack_values(msg))
    if not msg.groups or description is None:
        return config
    config["groups"] = get_tree(msg)
    described = {group["id"]: group for group in _all_described(description)}
    for group in _all(config["groups"]):
        known = described.get(group["id"])
        if known is not None:
            group["state"] = group["state"] if group["id"] == _ROOT else known["state"]
            for one in known["parameters"]:
                group["parameters"][one["name"]] = config[one["name"]]
    return config


def _all_described(group: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    yield group
    for inner in _inner(group):
        yield from _all_described(inner)


def decode_config(msg: ConfigMsg, description: Mapping[str, Any] | None = None) -> Config:
    """Return the configuration of a message; with a description, with its groups.

    Args:
        msg: The message.
        description: What `decode_description` returned. Each group has its parameters then.
    """
    config = Config(unpack_values(msg))
    if not msg.groups or description is None:
        return config
    config["groups"] = get_tree(msg)
    described = {group["id"]: group for group in _all_described(description)}
    for group in _all(config["groups"]):
        for one in described.get(group["id"], {"parameters": ()})["parameters"]:
            if one["name"] in config:
                group[one["name"]] = config[one["name"]]
    return config


def in_groups(config: Config, description: Mapping[str, Any]) -> Config:
    """Return a configuration of `rosz.reconfigure` in the form that ROS 1's clients give it.

    Args:
        config: The configuration.
        description: What `decode_description` returned.
    """
    return decode_config(encode_config(config), description)
