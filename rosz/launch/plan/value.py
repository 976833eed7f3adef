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


def load_yaml(text: str, path: str = "<string>") -> Any:
    """Read a YAML text as rosparam does; one without any value is the empty dict.

    Args:
        text: The text.
        path: Where it is from, for messages.

    Raises:
        YamlError: It is no YAML, has several documents, or holds what no parameter can.
    """
    from rosz.params.yaml import load_all

    documents = load_all(text, path)
    if len(documents) > 1:
        raise YamlError(f"it has {len(documents)} documents, expected one", path)
    return documents[0] if documents else {}


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
