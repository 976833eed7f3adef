"""Settings as the messages of dynamic_reconfigure, and back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import msgspec

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
from rosz.reconfigure.description import Description, Group
from rosz.reconfigure.setting import Kind, Setting, kind_of

__all__ = (
    "pack_config",
    "pack_description",
    "pack_values",
    "unpack_description",
    "unpack_states",
    "unpack_values",
)

_LEVELS = 0xFFFFFFFF
_ROOT = 0


def pack_values(values: Mapping[str, Any]) -> ConfigMessage:
    """Write values, each as the type that it has."""
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


def pack_config(
    description: Description, values: Mapping[str, Any], states: Mapping[int, bool]
) -> ConfigMessage:
    """Write values with the states of all groups: the root, then inner groups before outer."""
    message = pack_values(values)
    (root, parent), *_ = description.groups
    message.groups = [GroupState(root.name, states.get(root.id, root.state), root.id, parent)]
    message.groups += _packed_states(root, states)
    return message


def _packed_states(group: Group, states: Mapping[int, bool]) -> Iterator[GroupState]:
    for inner in group.groups:
        yield from _packed_states(inner, states)
        yield GroupState(inner.name, states.get(inner.id, inner.state), inner.id, group.id)


def unpack_values(message: ConfigMessage) -> dict[str, Any]:
    """Read values: truth values first, then whole numbers, texts and numbers."""
    parts: tuple[Iterable[Any], ...] = (message.bools, message.ints, message.strs, message.doubles)
    return {one.name: one.value for part in parts for one in part}


def unpack_states(message: ConfigMessage) -> dict[int, bool]:
    """Read the states of groups, by number."""
    return {state.id: state.state for state in message.groups}


def pack_description(description: Description) -> ConfigDescription:
    """Write a description."""
    settings = description.settings
    return ConfigDescription(
        groups=[_packed(group, parent) for group, parent in description.groups],
        max=pack_values({name: one.max for name, one in settings.items()}),
        min=pack_values({name: one.min for name, one in settings.items()}),
        dflt=pack_values({name: one.default for name, one in settings.items()}),
    )


def _packed(group: Group, parent: int) -> GroupMessage:
    parameters = [
        ParamDescription(
            one.name, one.kind or "", one.level & _LEVELS, one.description, one.edit_method
        )
        for one in group.settings
    ]
    return GroupMessage(group.name, group.type, parameters, parent, group.id)


def unpack_description(message: ConfigDescription) -> Description:
    """Read a description.

    Raises:
        DecodeError: It contradicts itself.
    """
    try:
        return Description(root=_tree(message))
    except (ParamError, KeyError, RecursionError) as error:
        raise DecodeError(message._type, -1, f"it contradicts itself: {error}") from error


def _tree(message: ConfigDescription) -> Group:
    limits = [unpack_values(one) for one in (message.dflt, message.min, message.max)]
    children: dict[int, list[GroupMessage]] = {}
    roots: list[GroupMessage] = []
    for group in message.groups:
        if group.id == _ROOT:
            roots.append(group)
        else:
            children.setdefault(group.parent, []).append(group)
    if len(roots) != 1:
        raise ParamError(f"{len(roots)} groups have the number 0, expected one")

    def built(group: GroupMessage) -> Group:
        return Group(
            name=group.name,
            settings=tuple(_setting(one, limits) for one in group.parameters),
            groups=tuple(map(built, children.get(group.id, ()))),
            type=group.type,
            id=group.id,
        )

    return built(roots[0])


def _setting(one: ParamDescription, limits: list[dict[str, Any]]) -> Setting:
    default, low, high = (values[one.name] for values in limits)
    try:
        kind = msgspec.convert(one.type, Kind)
    except msgspec.ValidationError as error:
        raise ParamError(f"'{one.name}' is of the unknown type '{one.type}'") from error
    return Setting(one.name, default, one.description, one.level, low, high, one.edit_method, kind)
