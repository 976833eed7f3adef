"""How text becomes a value: the types of ``<param>``, booleans, YAML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rosz.errors import YamlError, near_miss

__all__ = ("TYPES", "automatic", "boolean", "convert", "load_yaml")


def automatic(text: str) -> bool | int | float | str:
    """Guess a type as roslaunch does.

    A text with a dot is a float if it can be, one without is an int if it can be (``1e5`` is
    neither, nor is ``1_000``); ``true`` and ``false`` in any case are bool; the rest is text.
    """
    try:
        if "." in text:
            return float(text)
        if "_" not in text:
            return int(text)
    except ValueError:
        pass
    lower = text.lower()
    return lower == "true" if lower in {"true", "false"} else text


def boolean(text: str) -> bool:
    """Read a condition: ``true``, ``1``, ``false``, ``0`` in any case.

    Raises:
        ValueError: It is something else.
    """
    lower = text.lower().strip()
    if lower in {"true", "1"}:
        return True
    if lower in {"false", "0"}:
        return False
    raise ValueError(f"'{text}' is no bool; expected true, false, 1 or 0")


def _integer(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"'{text}' is no int") from None


def _double(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"'{text}' is no double") from None


def load_yaml(text: str) -> Any:
    """Read one YAML document as rosparam does.

    Raises:
        YamlError: It is none, with line and column in the text.
    """
    import yaml

    try:
        return yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        raise YamlError(str(error.problem), "<string>", line, column) from None
    except yaml.YAMLError as error:
        raise YamlError(str(error)) from None


TYPES: Mapping[str, Callable[[str], Any]] = {
    "auto": automatic,
    "bool": boolean,
    "boolean": boolean,
    "double": _double,
    "int": _integer,
    "str": str,
    "string": str,
    "yaml": load_yaml,
}
"""The types of ``<param>`` by name."""


def convert(text: str, type_name: str) -> Any:
    """Turn a text into a value of one of `TYPES`.

    Raises:
        ValueError: There is no such type, or the text is none of its values.
        YamlError: The type is ``yaml`` and the text is not.
    """
    reader = TYPES.get(type_name)
    if reader is None:
        hint = near_miss(type_name, TYPES) or f"; there are {', '.join(TYPES)}"
        raise ValueError(f"'{type_name}' is no type of <param>{hint}")
    return reader(text)
