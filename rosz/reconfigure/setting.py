"""One setting: its type, its bounds, and the conversion of values to it.

The rules are those of dynamic_reconfigure (ROS wiki, dynamic_reconfigure).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable
from typing import Any, Final, Literal, TypeAlias

import msgspec

from rosz.errors import ParamError

__all__ = ("BOUNDS", "Choice", "Kind", "Scalar", "Setting", "enumeration", "kind_of")

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
            found = _CONVERTERS[self._kind](_plain(value))
        except (TypeError, ValueError, OverflowError):
            names = ", ".join(choice.name for choice in choices)
            raise ParamError(
                f"'{self.name}' cannot be {value!r}: expected {_EXPECTED[self._kind]}"
                f"{' or one of ' + names if names else ''}"
            ) from None
        return self._check_range(found)

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
            "name": one.name,
            "type": kind_of(one.value),
            "value": one.value,
            "description": one.description,
        }
        for one in choices
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
    found = item() if callable(item) else value
    if not isinstance(found, Scalar):
        raise TypeError
    return found


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
