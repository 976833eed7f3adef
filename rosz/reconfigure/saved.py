"""Settings in files: YAML, plain in what is written here, and as ROS 1's dynparam writes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rosz.errors import YamlError
from rosz.params import yaml

__all__ = ("dump", "load")

_ROS1_TAG: Final = "!!python/object/new:dynamic_reconfigure.encoding.Config"
"""What stands before each configuration in a file of ROS 1's dynparam, a pickled one in effect."""

_ITEMS: Final = "dictitems"
_PICKLED: Final = frozenset({_ITEMS, "state"})


def dump(config: Mapping[str, Any]) -> str:
    """Write the values of a configuration, and under ``groups`` which groups are shown."""
    plain = {name: value for name, value in config.items() if name != "groups"}
    states = _states(config.get("groups", {}))
    return yaml.dump(plain | ({"groups": states} if states else {}))


def load(text: str, path: str = "<string>") -> dict[str, Any]:
    """Read what `dump`, or dynparam, wrote: of several documents, later ones win.

    Args:
        text: YAML.
        path: Where it is from, for messages.

    Returns:
        Name to value; under ``groups`` states by name.

    Raises:
        YamlError: It is no YAML, or no dictionary of names to values.
    """
    # Where the tag stands the value is a plain mapping; without it nothing is unpickled.
    ours = _ROS1_TAG in text
    found: dict[str, Any] = {}
    for document in yaml.load_all(text.replace(_ROS1_TAG, ""), path):
        plain = _unwrapped(document) if ours else document
        if not isinstance(plain, dict):
            raise YamlError(f"{plain!r:.60}: expected a dictionary of names to values", path)
        found |= plain
    groups = found.get("groups")
    if isinstance(groups, dict) and "state" in groups and "groups" in groups:
        found["groups"] = _states(groups)
    return found


def _states(tree: Mapping[str, Any]) -> dict[str, bool]:
    """Return the states of all groups in a tree by name, the root's left out."""
    states: dict[str, bool] = {}
    for name, group in tree.get("groups", {}).items():
        states[name] = bool(group["state"])
        states |= _states(group)
    return states


def _unwrapped(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if value.keys() <= _PICKLED and isinstance(value.get("state"), list):
        value = value.get(_ITEMS, {})
    return {name: _unwrapped(inner) for name, inner in value.items()}
