"""All settings of a node, in groups, and their values."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, Self

import msgspec

from rosz.errors import ParamError, near_miss
from rosz.reconfigure.setting import Kind, Setting

__all__ = ("Config", "Description", "Group")

_ROOT: Final = "Default"
_ORDER: Final[tuple[Kind, ...]] = ("bool", "int", "str", "double")
_UNNUMBERED: Final = -1


class Config(dict[str, Any]):
    """Values of all settings by name, also as attributes: ``config["gain"]`` is ``config.gain``.

    ``config["groups"]`` is the root of the tree of groups: a `Config` with ``id``, ``parent``,
    ``name``, ``type``, ``state`` (whether it is shown), ``groups`` by name, and ``parameters``.
    """

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"this configuration has no '{name}'") from None

    def __setattr__(self, name: str, value: object) -> None:
        self[name] = value

    def __delattr__(self, name: str) -> None:
        try:
            del self[name]
        except KeyError:
            raise AttributeError(f"this configuration has no '{name}'") from None

    def copy(self) -> Self:
        """Return a shallow copy."""
        return type(self)(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return type(self)({key: copy.deepcopy(value, memo) for key, value in self.items()})


class Group(msgspec.Struct, frozen=True):
    """Settings that belong together.

    Attributes:
        name: Name; groups in the same group must have different names.
        settings: Settings of the group itself.
        groups: Groups in the group.
        type: How a window shows it: empty, ``collapse``, ``tab``, ``hide`` or ``apply``.
        state: Whether it is shown by default.
        id: Number; `Description` replaces -1 by a new one.
    """

    name: str
    settings: tuple[Setting, ...] = ()
    groups: tuple[Group, ...] = ()
    type: str = ""
    state: bool = True
    id: int = _UNNUMBERED


class Description:
    """All settings that a server has.

    Args:
        settings: Settings in no group.
        groups: Groups of further settings.
        root: Group with the id 0 that holds everything, instead of settings and groups.

    Attributes:
        root: Group that holds everything.
        groups: Every group with the id of its parent, the root first.
        settings: Every setting by name.

    Raises:
        ParamError: Two settings have the same name, or two groups the same id.
    """

    def __init__(
        self,
        settings: Iterable[Setting] = (),
        groups: Iterable[Group] = (),
        *,
        root: Group | None = None,
    ) -> None:
        whole = root or Group(_ROOT, tuple(settings), tuple(groups), id=0)
        taken = [group.id for group, _ in _walk(whole, 0)]
        numbers = itertools.count(max(taken) + 1)
        self.root: Group = _numbered(whole, numbers)
        self.groups: tuple[tuple[Group, int], ...] = tuple(_walk(self.root, 0))
        self.settings: dict[str, Setting] = {}
        for group, _ in self.groups:
            for setting in group.settings:
                if setting.name in self.settings:
                    raise ParamError(f"two settings have the name '{setting.name}'")
                self.settings[setting.name] = setting
        if len({group.id for group, _ in self.groups}) < len(self.groups):
            raise ParamError(f"two groups have the same id; the ids are {taken}")

    def defaults(self) -> dict[str, Any]:
        """Return the default value of each setting."""
        return {name: setting.default for name, setting in self.settings.items()}

    def states(self) -> dict[int, bool]:
        """Return whether each group is shown by default, by id."""
        return {group.id: group.state for group, _ in self.groups}

    def setting(self, name: str) -> Setting:
        """Return the setting with a name.

        Raises:
            ParamError: The setting does not exist.
        """
        found = self.settings.get(name)
        if found is None:
            hint = near_miss(name, self.settings) or f"; there are {', '.join(self.settings)}"
            raise ParamError(f"there is no setting '{name}'{hint}")
        return found

    def convert(self, changes: Mapping[str, object]) -> dict[str, Any]:
        """Return changes with each value converted to the type of its setting.

        Args:
            changes: New values by name; ``groups`` is left out.

        Raises:
            ParamError: The setting does not exist, or a value cannot be converted.
        """
        return {
            name: self.setting(name).convert(value)
            for name, value in changes.items()
            if name != "groups"
        }

    def clamp(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return values with each limited to the bounds of its setting."""
        return {name: self.settings[name].clamp(value) for name, value in values.items()}

    def level(self, old: Mapping[str, Any], new: Mapping[str, Any]) -> int:
        """Return the bitwise or of the levels of all settings whose values differ."""
        level = 0
        for name, setting in self.settings.items():
            if old[name] != new[name]:
                level |= setting.level
        return level

    def read_states(self, groups: object) -> dict[int, bool]:
        """Return states of groups by id.

        Args:
            groups: States by the names of groups, or a tree as in ``groups`` of a `Config`.

        Raises:
            ParamError: The argument is neither, or there is no such group.
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
        """Return values and states as a configuration.

        Args:
            values: Value of every setting by name.
            states: States of groups by id; the default state for those missing.
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
