"""Settings in YAML files: plain ones, and those that dynparam wrote."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rosz.errors import YamlError
from rosz.params import yaml

_ROS1_TAG: Final = "!!python/object/new:dynamic_reconfigure.encoding.Config"
"""Tag of each configuration in a file of dynparam, which is a pickled object."""

_ITEMS: Final = "dictitems"
_PICKLED: Final = frozenset({_ITEMS, "state"})


def dump(config: Mapping[str, Any]) -> str:
    """Return a configuration as YAML: values, and states of groups under ``groups``."""
    plain = {name: value for name, value in config.items() if name != "groups"}
    states = _states(config.get("groups", {}))
    return yaml.dump(plain | ({"groups": states} if states else {}))


def load(text: str, path: str = "<string>") -> dict[str, Any]:
    """Return the settings that `dump` or dynparam wrote; later documents win over earlier ones.

    Args:
        text: YAML text.
        path: File that the text is from, for error messages.

    Returns:
        Values by name, and states by name under ``groups``.

    Raises:
        YamlError: The text is not YAML, or not a dictionary of names to values.
    """
    # Without its tag the value is a plain mapping; nothing is unpickled.
    is_pickled = _ROS1_TAG in text
    settings: dict[str, Any] = {}
    for document in yaml.load_all(text.replace(_ROS1_TAG, ""), path):
        plain = _unwrap(document) if is_pickled else document
        if not isinstance(plain, dict):
            raise YamlError(f"{plain!r:.60}: expected a dictionary of names to values", path)
        settings |= plain
    groups = settings.get("groups")
    if isinstance(groups, dict) and "state" in groups and "groups" in groups:
        settings["groups"] = _states(groups)
    return settings


def _states(tree: Mapping[str, Any]) -> dict[str, bool]:
    """Return the states of all groups in a tree by name, except for the root."""
    states: dict[str, bool] = {}
    for name, group in tree.get("groups", {}).items():
        states[name] = bool(group["state"])
        states |= _states(group)
    return states


def _unwrap(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if value.keys() <= _PICKLED and isinstance(value.get("state"), list):
        value = value.get(_ITEMS, {})
    return {name: _unwrap(inner) for name, inner in value.items()}
