"""The settings of a node, in groups: types, bounds, and the conversion of values.

The rules are those of dynamic_reconfigure (ROS wiki, dynamic_reconfigure).
"""

from __future__ import annotations

import ast
import copy
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final, Literal, Self, TypeAlias

import msgspec

from rosz.errors import ParamError, near_miss

Kind: TypeAlias = Literal["bool", "int", "str", "double"]
Scalar: TypeAlias = bool | int | str | float

BOUNDS: Final[dict[Kind, tuple[Scalar, Scalar]]] = {
    "bool": (False, True),
    "int": (-(1 << 31), (1 << 31) - 1),
    "str": ("", ""),
    "double": (float("-inf"), float("inf")),
}
"""Least and greatest value of a setting without bounds of its own; a str has none at all."""

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_TRUE: Final = frozenset({"true", "yes", "on", "t", "y", "1"})
_FALSE: Final = frozenset({"false", "no", "off", "f", "n", "0"})
_EXPECTED: Final[dict[Kind, str]] = {
    "bool": "true or false",
    "int": "a whole number",
    "str": "a text",
    "double": "a number",
}

_ROOT: Final = "Default"
_ORDER: Final[tuple[Kind, ...]] = ("bool", "int", "str", "double")
_UNNUMBERED: Final = -1


class Choice(msgspec.Struct, frozen=True):
    """One value of an enumeration.

    Attributes:
        name: Name that people write instead of the value.
        value: Value.
        description: Meaning, as shown to users.
    """

    name: str
    value: Scalar
    description: str = ""


class Setting(msgspec.Struct, frozen=True):
    """A value of a node that others can change.

    Attributes:
        name: Name: a letter, then letters, digits and underscores.
        default: Value if the parameter store has none.
        description: Purpose, as shown to users.
        level: Bits that the node's callback gets when the setting changes.
        min: Least value of a number.
        max: Greatest value of a number.
        edit_method: Values that the setting can have, as `enumeration` writes them; any if empty.
        kind: Type; that of the default if not given.

    Raises:
        ParamError: The name is not legal, or default and bounds do not fit the type.
    """

    name: str
    default: Scalar
    description: str = ""
    level: int = 0
    min: Scalar | None = None
    max: Scalar | None = None
    edit_method: str = ""
    kind: Kind | None = None

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ParamError(
                f"'{self.name}' is not a name of a setting: expected a letter, then letters, digits"
                " and underscores"
            )
        kind = self.kind or kind_of(self.default)
        low, high = BOUNDS[kind]
        if kind in {"bool", "str"} and (
            self.min not in {None, low} or self.max not in {None, high}
        ):
            raise ParamError(f"'{self.name}' is of type '{kind}', which has no min and max")
        force = msgspec.structs.force_setattr
        force(self, "kind", kind)
        force(self, "default", self._exact("default", self.default))
        force(self, "min", low if self.min is None else self._exact("min", self.min))
        force(self, "max", high if self.max is None else self._exact("max", self.max))

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The values that the setting can have, by name; empty if it can have any value."""
        return _choices(self.edit_method)

    def convert(self, value: object) -> Any:
        """Return a value converted to the type of the setting, whatever its bounds.

        Texts are parsed: numbers, bools, and names of choices in any case. A float loses its
        fraction where an int is expected.

        Args:
            value: Value to convert.

        Raises:
            ParamError: The value cannot be converted; the message names the choices, if any.
        """
        choices = self.choices if isinstance(value, str) else ()
        for choice in choices:
            if choice.name.lower() == str(value).lower():
                return choice.value
        try:
            converted = _CONVERTERS[self._kind](_plain(value))
        except (TypeError, ValueError, OverflowError):
            names = ", ".join(choice.name for choice in choices)
            raise ParamError(
                f"'{self.name}' cannot be {value!r}: expected {_EXPECTED[self._kind]}"
                f"{' or one of ' + names if names else ''}"
            ) from None
        return self._check_range(converted)

    def clamp(self, value: Any) -> Any:
        """Return the value within the bounds that is nearest to a converted value."""
        if self._kind in {"bool", "str"}:
            return value
        low, high = self.min, self.max
        return high if value > high else max(value, low)

    @property
    def _kind(self) -> Kind:
        return self.kind or kind_of(self.default)

    def _exact(self, what: str, value: Scalar) -> Scalar:
        """Return default, min or max as the type of the setting, which they must have."""
        kind = self._kind
        if kind_of(value) != kind and not (kind == "double" and kind_of(value) == "int"):
            raise ParamError(f"'{self.name}' has type {kind}, but {what} is {value!r}")
        return self._check_range(float(value) if kind == "double" else value)

    def _check_range(self, value: Scalar) -> Scalar:
        low, high = BOUNDS["int"]
        if self._kind == "int" and not low <= value <= high:  # type: ignore[operator]  # ints
            raise ParamError(
                f"'{self.name}' cannot be {value}: expected {low} to {high}, which is 32 bits"
            )
        return value


def kind_of(value: object) -> Kind:
    """Return the type of a setting that has a value.

    Raises:
        ParamError: No setting can have the value.
    """
    for kind, base in (("bool", bool), ("int", int), ("double", float), ("str", str)):
        if isinstance(value, base):
            return kind  # type: ignore[return-value]  # one of the four
    raise ParamError(f"{value!r} is not a value of a setting: expected bool, int, float or str")


def enumeration(choices: Iterable[Choice], description: str = "") -> str:
    """Return choices as the ``edit_method`` of a setting, as other tools read it.

    Args:
        choices: Values, all of one type.
        description: Meaning of the enumeration, as shown to users.
    """
    rows = [
        {
            "name": choice.name,
            "type": kind_of(choice.value),
            "value": choice.value,
            "description": choice.description,
        }
        for choice in choices
    ]
    return repr({"enum": rows, "enum_description": description})


def _choices(edit_method: str) -> tuple[Choice, ...]:
    # The text comes from the network: it is parsed as a literal, never evaluated.
    try:
        rows = ast.literal_eval(edit_method)["enum"] if edit_method else ()
        return tuple(
            Choice(str(row["name"]), row["value"], str(row.get("description", "")))
            for row in rows
            if isinstance(row["value"], Scalar)
        )
    except (ValueError, SyntaxError, TypeError, KeyError, AttributeError, RecursionError):
        return ()  # some other edit method


def _plain(value: object) -> Scalar:
    """Return a value of a setting, such as a numpy scalar, as a Python value."""
    item = getattr(value, "item", None)
    plain = item() if callable(item) else value
    if not isinstance(plain, Scalar):
        raise TypeError
    return plain


def _bool(value: Any) -> bool:
    if not isinstance(value, str):
        return bool(value)
    word = value.strip().lower()
    if word not in _TRUE | _FALSE:
        raise ValueError
    return word in _TRUE


def _int(value: Any) -> int:
    if not isinstance(value, str):
        return int(value)
    try:
        return int(value)
    except ValueError:
        return int(value, 0)  # as 0x1f


_CONVERTERS: Final[dict[Kind, Callable[[Any], Scalar]]] = {
    "bool": _bool,
    "int": _int,
    "str": str,
    "double": float,
}


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
        named = self.settings.get(name)
        if named is None:
            hint = near_miss(name, self.settings) or f"; there are {', '.join(self.settings)}"
            raise ParamError(f"there is no setting '{name}'{hint}")
        return named

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
    inner = tuple(_numbered(child, numbers) for child in group.groups)
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
