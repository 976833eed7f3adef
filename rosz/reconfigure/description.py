"""All settings of a node, in their groups."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import msgspec

from rosz.errors import ParamError, near_miss
from rosz.reconfigure.config import Config
from rosz.reconfigure.setting import Kind, Setting

__all__ = ("Description", "Group")

ROOT = "Default"
_ORDER: tuple[Kind, ...] = ("bool", "int", "str", "double")
_UNNUMBERED = -1


class Group(msgspec.Struct, frozen=True):
    """Settings that belong together.

    Attributes:
        name: Its name; only that of a sibling must differ.
        settings: Its settings.
        groups: Groups inside it.
        type: How a window shows it: empty, ``collapse``, ``tab``, ``hide`` or ``apply``.
        state: Whether it is shown at first.
        id: Its number; given by `Description` where it is -1.
    """

    name: str
    settings: tuple[Setting, ...] = ()
    groups: tuple[Group, ...] = ()
    type: str = ""
    state: bool = True
    id: int = _UNNUMBERED


class Description:
    """What a server lets others set.

    Args:
        settings: Those in no group.
        groups: The groups, with theirs.
        root: The root of it all instead, where there is one already; its number is 0.

    Attributes:
        root: The group that everything is in.
        groups: Every group with the number of the one around it, the root first.
        settings: Every setting by its name.

    Raises:
        ParamError: Two settings have one name, or two groups one number.
    """

    def __init__(
        self,
        settings: Iterable[Setting] = (),
        groups: Iterable[Group] = (),
        *,
        root: Group | None = None,
    ) -> None:
        whole = root or Group(ROOT, tuple(settings), tuple(groups), id=0)
        taken = [group.id for group, _ in _walk(whole, 0)]
        numbers = itertools.count(max(taken) + 1)
        self.root = _numbered(whole, numbers)
        self.groups = tuple(_walk(self.root, 0))
        self.settings: dict[str, Setting] = {}
        for group, _ in self.groups:
            for setting in group.settings:
                if setting.name in self.settings:
                    raise ParamError(f"two settings have the name '{setting.name}'")
                self.settings[setting.name] = setting
        if len({group.id for group, _ in self.groups}) < len(self.groups):
            raise ParamError(f"two groups have one number; the numbers are {taken}")

    def defaults(self) -> dict[str, Any]:
        """Return the value that each setting has at first."""
        return {name: setting.default for name, setting in self.settings.items()}

    def states(self) -> dict[int, bool]:
        """Return which groups, by number, are shown at first."""
        return {group.id: group.state for group, _ in self.groups}

    def setting(self, name: str) -> Setting:
        """Return the setting of a name.

        Raises:
            ParamError: There is none.
        """
        found = self.settings.get(name)
        if found is None:
            hint = near_miss(name, self.settings) or f"; there are {', '.join(self.settings)}"
            raise ParamError(f"there is no setting '{name}'{hint}")
        return found

    def convert(self, changes: Mapping[str, object]) -> dict[str, Any]:
        """Return changes as the types that the settings have.

        Args:
            changes: Name to new value; ``groups`` is left out.

        Raises:
            ParamError: There is no such setting, or a value cannot be one of it.
        """
        return {
            name: self.setting(name).convert(value)
            for name, value in changes.items()
            if name != "groups"
        }

    def clamp(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return values of the right types, each within its setting's bounds."""
        return {name: self.settings[name].clamp(value) for name, value in values.items()}

    def level(self, old: Mapping[str, Any], new: Mapping[str, Any]) -> int:
        """Return the levels of all settings that differ, or-ed."""
        level = 0
        for name, setting in self.settings.items():
            if old[name] != new[name]:
                level |= setting.level
        return level

    def read_states(self, groups: object) -> dict[int, bool]:
        """Return states of groups by number.

        Args:
            groups: States by the groups' names, or a tree as under ``groups`` of a `Config`.

        Raises:
            ParamError: It is neither, or there is no such group.
        """
        if not isinstance(groups, Mapping):
            raise ParamError(f"'groups' is {groups!r}; expected a dictionary of names to states")
        if "groups" in groups and "state" in groups:
            return {
                number: state
                for number, state in _states_in(groups)
                if any(number == group.id for group, _ in self.groups)
            }
        states: dict[int, bool] = {}
        names = [group.name for group, _ in self.groups]
        for name, state in groups.items():
            if name not in names:
                hint = near_miss(name, names) or f"; there are {', '.join(names)}"
                raise ParamError(f"there is no group '{name}'{hint}")
            states |= {group.id: bool(state) for group, _ in self.groups if group.name == name}
        return states

    def config(self, values: Mapping[str, Any], states: Mapping[int, bool]) -> Config:
        """Return values and states as one configuration.

        Args:
            values: A value for every setting.
            states: States of groups by number; those missing are as at first.
        """
        config = Config(
            (name, values[name])
            for kind in _ORDER
            for name, setting in self.settings.items()
            if setting.kind == kind
        )
        config["groups"] = _tree(self.root, 0, values, states)
        return config

    def __repr__(self) -> str:
        return f"<Description of {', '.join(self.settings)}>"


def _walk(group: Group, parent: int) -> Iterator[tuple[Group, int]]:
    yield group, parent
    for inner in group.groups:
        yield from _walk(inner, group.id)


def _numbered(group: Group, numbers: Iterator[int]) -> Group:
    number = next(numbers) if group.id == _UNNUMBERED else group.id
    inner = tuple(_numbered(one, numbers) for one in group.groups)
    return msgspec.structs.replace(group, id=number, groups=inner)


def _tree(
    group: Group, parent: int, values: Mapping[str, Any], states: Mapping[int, bool]
) -> Config:
    return Config(
        id=group.id,
        parent=parent,
        name=group.name,
        type=group.type,
        state=states.get(group.id, group.state),
        groups=Config(
            (inner.name, _tree(inner, group.id, values, states)) for inner in group.groups
        ),
        parameters=Config((setting.name, values[setting.name]) for setting in group.settings),
    )


def _states_in(tree: Mapping[str, Any]) -> Iterator[tuple[int, bool]]:
    yield tree.get("id", 0), bool(tree.get("state", True))
    for inner in tree.get("groups", {}).values():
        yield from _states_in(inner)
